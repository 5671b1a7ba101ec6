//! Tokens and numbers of a request.

pub(crate) use crate::pipeline::semantics::query::language::alike;
pub(crate) use crate::pipeline::semantics::query::language::tokens::{
    MAX_CHARS, Token, number, ordinal, request_tokens,
};
pub(crate) use crate::scene::identity::name_words::singular;
