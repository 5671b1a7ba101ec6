//! Reasons not to carry out a call at once: it conflicts with the facts of the scene, or the user must confirm it.

use super::describe::the;
use super::policy::{Permission, Policy};
use super::refusal::{Refusal, RefusalKind};
use super::tool::ToolCall;
use super::world::World;
use crate::math::format::capital;
use crate::scene::IdentityId;

/// Refusal of a call that conflicts with the facts of the scene.
pub(super) fn conflict(world: &dyn World, call: &ToolCall, id: Option<IdentityId>) -> Option<Refusal> {
    let id = id?;
    let facts = world.facts(id)?;
    let it = the(world, id);
    let text = match call {
        ToolCall::Hide { .. } if facts.hidden => format!("{} is hidden already.", capital(&it)),
        ToolCall::Unhide { .. } if !facts.hidden => format!("{} is not hidden.", capital(&it)),
        ToolCall::Rename { name, .. } if !name.chars().any(char::is_alphanumeric) => {
            return Some(Refusal::new(RefusalKind::Unclear, "A name needs at least one letter or digit."));
        }
        ToolCall::Rename { name, .. } if facts.names.first() == Some(name) => format!("It is called '{name}' already."),
        ToolCall::GoTo { .. } | ToolCall::LookAt { .. } | ToolCall::Measure { .. } | ToolCall::Export { .. }
            if facts.bounds.is_none() =>
        {
            format!("{} has no Gaussians in this scene, only a name.", capital(&it))
        }
        _ => return None,
    };
    Some(Refusal::new(RefusalKind::Conflict, text))
}

/// Question that the user must confirm before the call.
pub(super) fn question(world: &dyn World, call: &ToolCall, policy: &Policy, id: Option<IdentityId>) -> Option<String> {
    let permission = policy.permission(call.name());
    let it = id.map(|id| the(world, id)).unwrap_or_default();
    match (permission, call) {
        (Permission::ConfirmOverwrite, ToolCall::Export { .. }) => {
            let path = id.and_then(|id| world.export_replaces(id))?;
            Some(format!("Exporting {it} would replace {path}. Continue? (yes or no)"))
        }
        (Permission::ConfirmOverwrite | Permission::Free | Permission::Never, _) => None,
        (Permission::Confirm, ToolCall::Remove { .. }) => {
            Some(format!("Make a copy of this scene without {it}? (yes or no)"))
        }
        (Permission::Confirm, ToolCall::Rename { name, .. }) => Some(format!("Rename {it} to '{name}'? (yes or no)")),
        (Permission::Confirm, ToolCall::AskUser { .. }) => None,
        (Permission::Confirm, other) => Some(format!("{}: continue? (yes or no)", other.line(world.identities()))),
    }
}
