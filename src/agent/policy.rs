//! Policy of the tools: permitted, permitted after a confirmation, or forbidden. It is read from `assets/policy.toml`
//! or a file of the user.

use std::path::Path;

use serde::Deserialize;

use super::refusal::{Refusal, RefusalKind};
use super::tool::{NAMES, ToolCall};
use crate::io::IoError;
use crate::io::files::read;

/// Environment variable with the path of a policy that replaces the built-in one.
pub(crate) const VARIABLE: &str = "FMLGS_POLICY";
/// Largest policy file, in bytes.
const MAX_BYTES: u64 = 1 << 20;
/// Text of the built-in policy.
const BUILT_IN: &str = include_str!("../../assets/policy.toml");

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Tools {
    allowed: Vec<String>,
    #[serde(default)]
    confirm: Vec<String>,
    #[serde(default)]
    confirm_overwrite: Vec<String>,
    #[serde(default)]
    forbidden: Vec<String>,
}

/// Permissions of the tools.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Policy {
    tools: Tools,
}

/// Error of a policy. Without a valid policy nothing is permitted, so the agent does not start.
#[derive(Debug, thiserror::Error)]
pub enum PolicyError {
    /// The file cannot be read, or is too large.
    #[error("{0}; set {VARIABLE} to a policy file, or to nothing for the built-in one")]
    File(#[from] IoError),
    /// The text is not a valid policy.
    #[error("{place}: {problem}")]
    Wrong { place: String, problem: String },
}

/// Permission of a tool.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Permission {
    Free,
    Confirm,
    /// Permitted if no file is replaced, or after a confirmation.
    ConfirmOverwrite,
    Never,
}

impl Policy {
    /// Returns the built-in policy.
    ///
    /// # Errors
    /// Only if the program was built with an invalid policy.
    pub fn built_in() -> Result<Self, PolicyError> {
        Self::parse(BUILT_IN, "built-in policy")
    }

    /// Reads the file that `FMLGS_POLICY` names, else the built-in policy.
    ///
    /// # Errors
    /// If that file cannot be read or is not a valid policy.
    pub(crate) fn from_environment() -> Result<Self, PolicyError> {
        match std::env::var_os(VARIABLE).filter(|v| !v.is_empty()) {
            Some(path) => Self::load(Path::new(&path)),
            None => Self::built_in(),
        }
    }

    /// Reads a policy file.
    ///
    /// # Errors
    /// If it cannot be read or is not a valid policy.
    pub(crate) fn load(path: &Path) -> Result<Self, PolicyError> {
        let place = path.display().to_string();
        let bytes = read(path, MAX_BYTES)?;
        let text = std::str::from_utf8(&bytes)
            .map_err(|e| PolicyError::Wrong { place: place.clone(), problem: format!("not UTF-8 text: {e}") })?;
        Self::parse(text, &place)
    }

    /// Parses a policy; `place` is named in errors.
    ///
    /// # Errors
    /// If it is invalid TOML or names unknown tools.
    pub fn parse(text: &str, place: &str) -> Result<Self, PolicyError> {
        let wrong = |problem: String| PolicyError::Wrong { place: place.to_owned(), problem };
        let policy: Self =
            toml::from_str(text.strip_prefix('\u{feff}').unwrap_or(text)).map_err(|e| wrong(e.to_string()))?;
        let tools = &policy.tools;
        let lists = [&tools.allowed, &tools.confirm, &tools.confirm_overwrite, &tools.forbidden];
        if let Some(stranger) = lists.into_iter().flatten().find(|t| !NAMES.contains(&t.as_str())) {
            return Err(wrong(format!("there is no tool '{stranger}'; tools are: {}", NAMES.join(", "))));
        }
        Ok(policy)
    }

    /// Returns a policy that permits everything without confirmation, as a control in tests.
    pub fn off() -> Self {
        let allowed = NAMES.iter().map(|n| (*n).to_owned()).collect();
        let tools = Tools { allowed, confirm: Vec::new(), confirm_overwrite: Vec::new(), forbidden: Vec::new() };
        Self { tools }
    }

    /// Returns the permission of a tool.
    pub(crate) fn permission(&self, tool: &str) -> Permission {
        let has = |list: &[String]| list.iter().any(|t| t == tool);
        match &self.tools {
            t if has(&t.forbidden) || !has(&t.allowed) => Permission::Never,
            t if has(&t.confirm) => Permission::Confirm,
            t if has(&t.confirm_overwrite) => Permission::ConfirmOverwrite,
            _ => Permission::Free,
        }
    }

    /// Tools that are not forbidden.
    pub(crate) fn usable(&self) -> impl Iterator<Item = &'static str> + '_ {
        NAMES.into_iter().filter(|n| self.permission(n) != Permission::Never)
    }

    /// Returns a refusal if `call` is forbidden.
    pub(crate) fn refusal(&self, call: &ToolCall) -> Option<Refusal> {
        let never = self.permission(call.name()) == Permission::Never;
        never.then(|| Refusal::new(RefusalKind::NotPermitted, format!("The policy does not permit '{}'.", call.name())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_built_in_policy_is_whole() {
        let policy = Policy::built_in().expect("policy");
        assert_eq!(policy.permission("remove"), Permission::Confirm);
        assert_eq!(policy.permission("go_to"), Permission::Free);
        assert_eq!(policy.permission("export"), Permission::ConfirmOverwrite);
        assert_eq!(policy.permission("shell"), Permission::Never);
        assert_eq!(policy.usable().count(), NAMES.len());
        assert_eq!(Policy::off().permission("remove"), Permission::Free);
    }

    #[test]
    fn a_policy_of_ones_own_is_checked() {
        let own = "[tools]\nallowed = [\"go_to\", \"remove\"]\nforbidden = [\"remove\"]";
        let policy = Policy::parse(own, "own").expect("policy");
        assert_eq!((policy.permission("remove"), policy.permission("move")), (Permission::Never, Permission::Never));
        assert!(policy.refusal(&ToolCall::Undo {}).is_some());
        for bad in [
            "",
            "[tools]",
            "[tools]\nallowed = [\"fly\"]",
            "[tools]\nallowed = []\nallow = 3",
            "[tools]\nallowed = []\n[[rule]]\nactions = []",
        ] {
            assert!(matches!(Policy::parse(bad, "bad"), Err(PolicyError::Wrong { .. })), "{bad}");
        }
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("policy.toml");
        assert!(matches!(Policy::load(&path), Err(PolicyError::File { .. })));
        std::fs::write(&path, "#".repeat(MAX_BYTES as usize + 1)).expect("written");
        assert!(matches!(Policy::load(&path), Err(PolicyError::File(IoError::OverBudget { .. }))));
        assert!(matches!(Policy::load(folder.path()), Err(PolicyError::File(IoError::NotAFile { .. }))));
    }
}
