//! Relations and views, as the language of questions has them.

pub use crate::pipeline::semantics::query::language::expression::Relation;
pub use crate::pipeline::semantics::query::language::viewpoint::Viewpoint;
