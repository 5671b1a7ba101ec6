//! Examples of commands with names of the scene.

use crate::agent::language::CommandHelp;
use crate::scene::Identities;
use crate::scene::identity::lexicon::is_a;
use crate::scene::identity::name_words::words as name_words;

/// Example of a command with a name of this scene.
pub(super) fn example(command: &CommandHelp, identities: &Identities, request: &[&str]) -> String {
    let names = || identities.iter().filter_map(|(_, i)| i.names.first());
    let spoken = names().find(|n| name_words(n).iter().all(|w| request.iter().any(|r| name_words(r).contains(w))));
    let name = spoken.or_else(|| names().find(|n| !is_ground(n))).or_else(|| names().next());
    let name = name.map_or("lamp", String::as_str);
    command.example.replace("{}", name)
}

/// True if a thing of this name is what others stand on or lean against: nobody goes behind the floor.
fn is_ground(name: &str) -> bool {
    let name = name_words(name).join(" ");
    ["floor", "ground", "wall", "ceiling", "table", "road"].iter().any(|ground| is_a(&name, ground).is_some())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Level, NO_IDENTITY};

    #[test]
    fn nobody_is_told_to_go_behind_the_floor() {
        let command = CommandHelp {
            id: "behind".into(),
            does: String::new(),
            example: "go behind the {}".into(),
            forms: Vec::new(),
        };
        let mut all = Identities::default();
        assert_eq!(example(&command, &all, &[]), "go behind the lamp");
        all.add(Level::Object, NO_IDENTITY, vec!["wooden floor".into()]);
        assert_eq!(example(&command, &all, &[]), "go behind the wooden floor", "there is nothing else");
        all.add(Level::Object, NO_IDENTITY, vec!["table".into()]);
        all.add(Level::Object, NO_IDENTITY, vec!["kettle".into()]);
        assert_eq!(example(&command, &all, &[]), "go behind the kettle");
        // Control: what was spoken of is taken, whatever it is.
        assert_eq!(example(&command, &all, &["table"]), "go behind the table");
    }
}
