//! Asking a scene from the command line: its objects, and what answers questions about them.

use std::path::Path;

use super::CliError;
use crate::io;
use crate::pipeline::semantics::answer::Answered;
use crate::pipeline::semantics::asker;
use crate::pipeline::semantics::grammar::Kind;
use crate::scene::{GaussianCloud, SemanticMap};

/// The objects of the scene in the folder `scene`, whose Gaussians `cloud` are of the save `state`.
pub fn semantics(scene: &Path, state: Option<&str>, cloud: &GaussianCloud) -> Result<SemanticMap, CliError> {
    io::semantic_map::load(scene, state, cloud)?.ok_or_else(|| {
        let path = scene.display();
        CliError::failed(format!("{path} knows no objects yet; find them with 'fmlgs preprocess {path}'"))
    })
}

/// What answers questions about a scene.
pub struct Asker<'a> {
    map: &'a SemanticMap,
    asker: asker::Asker,
}

impl<'a> Asker<'a> {
    /// With the encoder that looked at the scene's identities, if one has.
    pub fn new(map: &'a SemanticMap) -> Result<Self, CliError> {
        Ok(Self { map, asker: asker::Asker::new(map.language.as_ref())? })
    }

    /// Answers a question; `None` if there is nothing in it.
    pub fn ask(&mut self, text: &str, kind: Kind) -> Result<Option<Answered>, CliError> {
        Ok(self.asker.ask(self.map, text, kind)?)
    }

    /// The words of a question that nothing here knows.
    pub fn unknown_words(&self, text: &str) -> Vec<String> {
        self.asker.unknown_words(&self.map.identities, text)
    }
}
