//! Options without effect are refused; every requirement holds whatever else is given.

use std::collections::BTreeSet;

use clap::{Arg, ArgAction, ArgMatches, Command, CommandFactory};

use super::rules::{RECIPE, RULES};
use super::{Given, check_all};
use crate::cli::Cli;

/// Sample values; every option accepts one of them.
const SAMPLES: [&str; 15] = [
    "1",
    "x.ply",
    "1,1",
    "0,0,1",
    "0,0,0,1,1,1",
    "64x48",
    "#ff0000",
    "photos=full",
    "127.0.0.1:7071",
    "1/2",
    "a=b",
    "floaters",
    "x",
    "0.5",
    "64",
];

/// All commands with the words that lead to them.
fn commands() -> Vec<(Vec<String>, Command)> {
    fn below(words: &[String], command: &Command, all: &mut Vec<(Vec<String>, Command)>) {
        for inner in command.get_subcommands().filter(|c| c.get_name() != "help") {
            let words = [words, &[inner.get_name().to_owned()]].concat();
            all.push((words.clone(), inner.clone()));
            below(&words, inner, all);
        }
    }
    let mut all = Vec::new();
    below(&[], &Cli::command(), &mut all);
    all
}

fn parsed(words: &[String]) -> Result<ArgMatches, String> {
    let line = std::iter::once("fmlgs".to_owned()).chain(words.iter().cloned());
    Cli::command().try_get_matches_from(line).map_err(|e| e.to_string())
}

/// Reason for which clap or the rules refuse a line; `None` if they accept it.
fn refusal(words: &[String]) -> Option<String> {
    match parsed(words) {
        Err(e) => Some(e),
        Ok(matches) => check_all(&Cli::command(), &matches).err(),
    }
}

fn split(line: &str) -> Vec<String> {
    line.split_whitespace().map(str::to_owned).collect()
}

/// An argument with a value that it accepts, as it is typed.
fn typed(argument: &Arg) -> Vec<String> {
    let option = |value: Option<&str>| match (argument.get_long(), value) {
        (Some(long), None) => vec![format!("--{long}")],
        (Some(long), Some(value)) => vec![format!("--{long}={value}")],
        (None, value) => vec![value.unwrap_or("x").to_owned()],
    };
    if matches!(argument.get_action(), ArgAction::SetTrue) {
        return option(None);
    }
    let named = argument.get_possible_values().first().map(|v| v.get_name().to_owned());
    let accepts = |value: &&str| {
        let alone = Arg::new("x").long("x").allow_hyphen_values(true).value_parser(argument.get_value_parser().clone());
        Command::new("x").arg(alone).try_get_matches_from(["x", &format!("--x={value}")]).is_ok()
    };
    let found = named.or_else(|| SAMPLES.iter().find(|s| accepts(s)).map(|s| (*s).to_owned()));
    option(Some(&found.unwrap_or_else(|| panic!("no sample for {}", argument.get_id()))))
}

/// Arguments that an argument requires, which clap shows nowhere else.
fn required_by(argument: &Arg) -> Vec<String> {
    let text = format!("{argument:?}");
    let list =
        text.split_once(" requires: [").map_or("", |(_, rest)| rest.split_once(']').map_or("", |(list, _)| list));
    list.split('"').skip(1).step_by(2).map(str::to_owned).collect()
}

/// An argument with all that it requires, and that requires in turn.
fn with_required<'a>(command: &'a Command, argument: &'a Arg) -> Vec<&'a Arg> {
    let mut all = vec![argument];
    let mut at = 0;
    while let Some(next) = all.get(at) {
        for id in required_by(next) {
            let is_new = |a: &&Arg| a.get_id() == id.as_str() && all.iter().all(|b| b.get_id() != a.get_id());
            let found = command.get_arguments().find(is_new);
            all.extend(found);
        }
        at += 1;
    }
    all
}

/// All ways to give some of what a command needs besides: positional arguments and where the result goes.
fn besides(command: &Command, without: &[&Arg]) -> Vec<Vec<String>> {
    let is_free = |a: &&Arg| !without.iter().any(|w| w.get_id() == a.get_id());
    let needed = |a: &&Arg| a.is_positional() || a.is_required_set() || a.get_id() == "out" || a.get_id() == "channel";
    let mut all = vec![Vec::new()];
    for argument in command.get_arguments().filter(needed).filter(is_free) {
        let more: Vec<Vec<String>> = all.iter().map(|line| [line.clone(), typed(argument)].concat()).collect();
        all.extend(more);
    }
    all
}

/// Nothing, and each flag and each choice among named ones that a command has besides: some options go with one only.
fn choices(command: &Command, without: &[&Arg]) -> Vec<Vec<String>> {
    let mut all = vec![Vec::new()];
    for argument in command.get_arguments().filter(|a| !without.iter().any(|w| w.get_id() == a.get_id())) {
        let Some(long) = argument.get_long() else { continue };
        if !argument.get_action().takes_values() {
            all.push(vec![format!("--{long}")]);
            continue;
        }
        all.extend(argument.get_possible_values().iter().map(|v| vec![format!("--{long}={}", v.get_name())]));
    }
    all
}

#[test]
fn what_is_required_is_required_whatever_else_is_given() {
    let (mut pairs, mut alone) = (0, 0);
    for (words, command) in commands() {
        let of = |id: &str| command.get_arguments().find(|a| a.get_id() == id);
        for argument in command.get_arguments().filter(|a| !a.is_positional()) {
            for required in required_by(argument) {
                let Some(required) = of(&required) else { continue };
                let told = |line: &[String]| format!("'{}' is accepted", line.join(" "));
                // The control: together they are accepted, with something beside them.
                let with = with_required(&command, argument);
                let choices = choices(&command, &with);
                let together = besides(&command, &with).into_iter().any(|rest| {
                    let given = with.iter().flat_map(|a| typed(a)).collect();
                    let line = [words.clone(), rest, given].concat();
                    choices.iter().any(|choice| refusal(&[line.clone(), choice.clone()].concat()).is_none())
                });
                assert!(together, "{words:?}: --{} is never accepted", argument.get_id());
                for rest in besides(&command, &[argument, required]) {
                    let line = [words.clone(), rest, typed(argument)].concat();
                    assert!(refusal(&line).is_some(), "{}", told(&line));
                    alone += 1;
                }
                let conflicts = |a: &&Arg| {
                    let is = |one: &Arg, other: &Arg| {
                        command.get_arg_conflicts_with(one).iter().any(|c| c.get_id() == other.get_id())
                    };
                    a.get_id() != argument.get_id() && (is(required, a) || is(a, required))
                };
                for companion in command.get_arguments().filter(conflicts) {
                    for rest in besides(&command, &[argument, required, companion]) {
                        let line = [words.clone(), rest, typed(companion), typed(argument)].concat();
                        assert!(refusal(&line).is_some(), "{}", told(&line));
                        pairs += 1;
                    }
                }
            }
        }
    }
    assert!(pairs > 100 && alone > 100, "{pairs} lines with a companion, {alone} alone: clap tells less than it did");
}

/// Lines in which the option is refused, and accepted with what it needs. `{}` stands for each of the options.
const LINES: &[(&str, &[&str], &str)] = &[
    ("query s lamp {}", &["--tolerance 3", "--export o", "--truth t", "--views all", "--relevancy raw"], ""),
    ("query s lamp --match identities {}", &["--tolerance 3"], "query s lamp --match codes --tolerance 3"),
    (
        "query s lamp --recipe paper --match relevancy {}",
        &["--tolerance 3"],
        "query s lamp --recipe paper --tolerance 3",
    ),
    ("query s lamp --by names {}", &["--temperature 2", "--canonical lerf", "--deviation off"], ""),
    ("query s lamp --mask a.png {}", &["--heat a.png", "--heat ./a.png"], "query s lamp --mask a.png --heat b.png"),
    ("query s --phrases f {}", &["--arrays"], "query s lamp --out o --arrays"),
    ("query s lamp {}", &["--relevancy raw"], "query s lamp --out o --relevancy raw"),
    ("features r --codes a.npy {}", &["--embeddings a.npy"], "features r --codes a.npy --embeddings b.npy"),
    ("query s --phrases f {}", &["--relevancy raw"], "query s --phrases f --top 2 --kind part --views all --export o"),
    ("segment s lamp --out o.ply {}", &["--format spz", "--masks isat", "--views none", "--max-side 64"], ""),
    ("segment s lamp --out o.ply {}", &["--click-out 1,1", "--view 0", "--keep lamp", "--relevancy raw"], ""),
    ("segment s lamp --out o.ply {}", &["--width 5", "--correct lid"], "segment s --click 1,1 --width 5 --correct lid"),
    (
        "segment s --click 1,1 --out o.ply {}",
        &["--top 2", "--kind part", "--by names"],
        "segment s --click 1,1 --keep x",
    ),
    ("segment s --click 1,1 --out o.ply {}", RECIPE, "segment s lamp --out o.ply --by names --top 2"),
    ("segment s --click 1,1 --keep x {}", &["--no-measure"], "segment s --click 1,1 --out o.ply --no-measure"),
    ("segment s --all --out o {}", &["--no-measure"], "segment s --all --out o --format spz --views none"),
    ("segment s lamp {}", &["--keep x", "--correct x"], ""),
    ("eval s {}", RECIPE, "eval s --masks m --by names"),
    ("eval s {}", &["--protocol masks", "--query lamp"], "eval s --masks m --protocol spin-nerf --query lamp"),
    ("eval s --depth {}", &["--decoder f", "--encoder e"], "eval s --masks m --decoder f --encoder e"),
    ("eval s --masks m {}", &["--keep-borders", "--query lamp", "--relevancy raw"], "eval s --masks m --pictures p"),
    ("eval s --masks m --protocol strokes {}", &["--by names", "--pictures p"], ""),
    ("eval s --masks m --protocol corrections {}", RECIPE, ""),
    ("eval s --masks m {}", &["--align-poses", "--fit-exposure"], "eval s --align-poses --fit-exposure"),
    ("eval s --removal r {}", &["--align-poses", "--fit-exposure"], ""),
    ("eval s --depth {}", &["--align-poses", "--fit-exposure"], ""),
    ("eval s --questions q {}", &["--align-poses", "--fit-exposure"], ""),
    ("eval s --questions q {}", &["--pictures p", "--keep-borders"], "eval s --questions q --by names"),
    ("eval s --depth {}", &["--pictures p", "--keep-borders", "--by names"], "eval s --pictures p --keep-borders"),
    ("eval s --removal r {}", &["--by names", "--query lamp"], "eval s --removal r --pictures p"),
    ("train p {}", &["--host h", "--bind-anywhere", "--token-file f"], "train p --serve --host h --token-file f"),
    ("train p --no-densify {}", &["--max-gaussians 9"], "train p --max-gaussians 9"),
    ("train p --sh-degree 0 {}", &["--sh-at-once"], "train p --sh-degree 1 --sh-at-once"),
    ("train p --surfels {}", &["--antialias", "--no-antialias"], "train p --surfels --distortion-weight 1"),
    ("train p {}", &["--distortion-weight 1"], ""),
    (
        "demo {}",
        &["--steps 9", "--max-side 64", "--seed 2", "--surfels", "--json", "--out o"],
        "demo --headless --steps 9",
    ),
    ("demo --headless {}", &["--held-out-every 4"], "demo --headless --json --out o"),
    ("demo --headless --no-densify {}", &["--max-gaussians 9"], ""),
    ("demo --headless --sh-degree 0 {}", &["--sh-at-once"], ""),
    ("demo --headless --surfels {}", &["--antialias", "--no-antialias"], ""),
    ("demo --make z.zip {}", &["--steps 9", "--json", "--backend cpu"], "demo --make z.zip --out o"),
    ("preprocess s {}", &["--tracker-model x", "--prompt mask"], "preprocess s --tracker sam2 --tracker-model x"),
    (
        "preprocess s --recipe paper --tracker geometry {}",
        &["--prompt mask"],
        "preprocess s --recipe paper --prompt mask",
    ),
    ("preprocess s --add p {}", &["--tracker-model x"], "preprocess s --add p"),
    (
        "preprocess s --masks m {}",
        &["--mask-grid all", "--code-steps 5"],
        "preprocess s --lifting refined --code-steps 5",
    ),
    ("preprocess s --segmenter regions {}", &["--mask-grid all"], "preprocess s --segmenter m --mask-grid all"),
    ("preprocess s --encoder none {}", &["--part-weight 0.5"], "preprocess s --encoder demo --part-weight 0.5"),
    ("remove s lamp --out o --fill none {}", &["--paint smooth", "--seed 2"], "remove s lamp --out o --seed 2"),
    ("remove s lamp --out o --paint lama {}", &["--seed 2"], "remove s lamp --out o --fill photos --paint lama"),
    ("remove s lamp --out o --paint smooth {}", &["--seed 2"], "remove s lamp --out o --paint patches --seed 2"),
    ("render s --out a.png {}", &["--quality 50", "--fps 9", "--mark lamp", "--ffmpeg f"], ""),
    ("render s --path p.json --out frames/ {}", &["--quality 50"], "render s --path p.json --out v.webp --quality 50"),
    (
        "path s --to-photo 3 {}",
        &["--side other", "--distance 2", "--cameras 9", "--aspect 1"],
        "path s --to a --side other",
    ),
    (
        "path s --survey 3 {}",
        &["--side other", "--distance 2", "--from 2", "--aspect 1"],
        "path s --survey 3 --frames 9",
    ),
    (
        "export s --out a.ply --json {}",
        &["--title t", "--path p.json"],
        "export s --html p.html --title t --path p.json",
    ),
    (
        "locate s a.jpg {}",
        &["--check-others o", "--unknown-focal", "--check-changes"],
        "locate s --check --check-others o --unknown-focal --check-changes",
    ),
    (
        "poses p --by-hand {}",
        &["--out o", "--maker colmap", "--frames 9", "--install", "--compare g", "--json"],
        "poses p --out o --frames 9 --compare g --json",
    ),
    ("poses p --maker colmap {}", &["--install"], "poses p --maker pycolmap --install"),
    ("locate s --check {}", &["--focal-px 9", "--out t.json"], "locate s a.jpg --focal-px 9 --out t.json"),
    ("export s --html p.html {}", &["--no-measure"], "export s --html p.html --out a.ply --no-measure"),
    ("agent s hi {}", &["--url u", "--model m", "--key-variable k"], "agent s hi --planner llm --url u --model m"),
    ("agent --find-model {}", &["--url u", "--from 0", "--transcript t.md", "--by names"], "agent --find-model --json"),
    ("agent --test-model --url u --model m {}", &["--json", "--view v.png"], "agent --test-model --url u --model m"),
    ("agent s hi {}", &["--tolerance 3"], "agent s hi --blend --tolerance 3"),
    ("agent s hi --by names {}", &["--temperature 2"], ""),
    (
        "report s {}",
        &["--from f", "--steps 9", "--by names", "--relevancy raw"],
        "report s --masks m --steps 9 --by names",
    ),
    (
        "report s --stages render {}",
        &["--steps 9", "--masks m", "--train-steps 50", "--by names"],
        "report s --train-steps 50",
    ),
    ("report s --masks m --stages query {}", &["--steps 9"], "report s --masks m --stages features,query --steps 9"),
    ("report s --stages path {}", &["--view-count 2"], "report s --stages path,render --view-count 2"),
    ("report --defaults d.md --from f {}", &["--budget 9", "--out o", "--fresh", "--repeats 2", "--by names"], ""),
    (
        "batch j.toml --dry-run {}",
        &["--retry-failed", "--takeover-secs 9"],
        "batch j.toml --retry-failed --takeover-secs 9",
    ),
    ("bench s {}", &["--identities 5", "--mask-grid all", "--photo f"], "bench s --queries 5 --identities 5"),
    ("bench --queries 5 {}", &["--size 64x48", "--max-side 64", "--gpu"], "bench --queries 5 --identities 9"),
    ("models fetch m {}", &["--json"], "models check --json"),
    ("models add m f {}", &["--json"], "models --json"),
    ("synth g --out o {}", &["--keep-shadow"], "synth g --out o --without x --keep-shadow"),
    ("edit s lamp --out o --scale 2 {}", &["--axis 0,0,1"], "edit s lamp --out o --turn 9 --axis 0,0,1"),
    ("connect u {}", &["--save a.ply", "--json"], "connect u --headless --save a.ply --json"),
];

#[test]
fn options_that_do_nothing_are_refused_by_name() {
    let mut fired: BTreeSet<usize> = BTreeSet::new();
    for (line, options, accepted) in LINES {
        let command =
            parsed(&split(&line.replace("{}", ""))).ok().map(|m| m.subcommand_name().unwrap_or("").to_owned());
        for option in *options {
            // An option by its name alone gets a value.
            let words = match option.strip_prefix("--") {
                Some(_) => split(option),
                None => {
                    let of = commands().into_iter().find(|(words, _)| Some(&words[0]) == command.as_ref());
                    let (_, of) = of.unwrap_or_else(|| panic!("{line}"));
                    typed(of.get_arguments().find(|a| a.get_id() == *option).unwrap_or_else(|| panic!("{option}")))
                }
            };
            let whole = split(&line.replace("{}", &words.join(" ")));
            let why = refusal(&whole).unwrap_or_else(|| panic!("accepted: {}", whole.join(" ")));
            let name = words[0].split('=').next().unwrap_or_default();
            assert!(why.contains(name), "{}: {why}", whole.join(" "));
            if let Ok(matches) = parsed(&whole) {
                fired.extend(firing(&matches));
            }
        }
        if !accepted.is_empty() {
            assert_eq!(refusal(&split(accepted)), None, "{accepted}");
        }
    }
    let idle: Vec<String> = (0..RULES.len())
        .filter(|k| !fired.contains(k))
        .map(|k| format!("{:?} {:?}", RULES[k].commands, RULES[k].options))
        .collect();
    // What clap itself refuses in all lines stands in the rules for the lines where it does not.
    let of_clap = [
        "\"synth\"",
        "\"edit\"",
        "\"connect\"",
        "\"from\"",
        "\"cameras\"",
        "[\"distortion_weight\"]",
        "[\"identities\"]",
        "[\"mask_grid\", \"photo\"]",
    ];
    let missing: Vec<&String> = idle.iter().filter(|rule| !of_clap.iter().any(|c| rule.contains(c))).collect();
    assert!(missing.is_empty(), "no line for these rules: {missing:#?}");
}

/// The rules by number that refuse something of a command line.
fn firing(matches: &ArgMatches) -> Vec<usize> {
    let (mut name, mut at) = (String::new(), matches);
    while let Some((next, inner)) = at.subcommand() {
        name = if name.is_empty() { next.to_owned() } else { format!("{name} {next}") };
        at = inner;
    }
    let given = Given(at);
    let fires = |k: &usize| {
        let rule = &RULES[*k];
        rule.commands.contains(&name.as_str())
            && rule.options.iter().any(|id| given.has(id))
            && (rule.idle)(&given).is_some()
    };
    (0..RULES.len()).filter(fires).collect()
}

#[test]
fn the_rules_speak_of_what_there_is() {
    let all = commands();
    for rule in RULES {
        for name in rule.commands.iter().filter(|name| **name != "batch eval") {
            let (_, command) =
                all.iter().find(|(words, _)| words.join(" ") == *name).unwrap_or_else(|| panic!("{name}"));
            for id in rule.options {
                assert!(command.get_arguments().any(|a| a.get_id() == *id) || *id == "json", "{name} has no '{id}'");
            }
        }
    }
}

#[test]
fn what_is_said_names_the_option_and_what_it_needs() {
    let told = |line: &str| refusal(&split(line)).expect(line);
    assert_eq!(told("segment s lamp --out l.ply --keep my"), "--keep has no effect without --click");
    assert_eq!(told("segment s lamp --out l.ply --format spz"), "--format has no effect without --all");
    assert_eq!(told("query s lamp --export out --truth t"), "--truth has no effect without --phrases");
    assert_eq!(told("agent s hi --model m"), "--model has no effect without --planner llm");
    let asked = "--by has no effect without --masks or --questions: nothing is asked for";
    assert_eq!(told("eval s --by names"), asked);
}
