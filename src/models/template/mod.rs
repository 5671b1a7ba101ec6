//! Templates: the graphs of a model without their weights, which an official checkpoint fills.
//!
//! `tools/export/template.py` makes one: an archive of graphs and of `template.json`, which maps each weight to a
//! tensor of the checkpoint. Concatenated messages of protocol buffers merge, so a filled graph is its template
//! followed by the weights, and no graph has to be parsed.
//!
//! A model is made of a checkpoint whole or not at all.

#[cfg(test)]
mod mask_tests;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufWriter, Cursor, Read, Write};
use std::path::Path;

use serde::Deserialize;
use serde_json::{Value, json};
use sha2::Digest;
use zip::ZipArchive;

use super::ModelError;
use crate::io::error::write_error;
use crate::io::files::{Summed, hex};
use crate::io::temporary::temporary_folder;
use crate::io::torch::{WeightFile, WeightFileError};

/// Prefixes that the tensors of a checkpoint may have.
const ROOTS: [&str; 4] = ["", "model.", "state_dict.", "module."];
/// Last names of tensors in official files that are no weights: settings, and values derived from them.
const SETTINGS: [&str; 5] = ["attn_mask", "context_length", "input_resolution", "position_ids", "vocab_size"];

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Table {
    /// Description of the model, without the fields that depend on the weights.
    description: serde_json::Map<String, Value>,
    /// By role of a graph: name of a weight, its tensor, and its shape.
    weights: BTreeMap<String, Vec<(String, String, Vec<u64>)>>,
    /// Fields of the description that are tensors.
    values: BTreeMap<String, String>,
    /// Shapes of the tensors.
    tensors: BTreeMap<String, Vec<usize>>,
    /// Tensors of official checkpoints that no graph needs.
    unused: Vec<String>,
}

/// Template in memory.
pub(crate) struct Template<'a> {
    table: Table,
    archive: ZipArchive<Cursor<&'a [u8]>>,
}

impl<'a> Template<'a> {
    /// Reads a template of the program.
    pub(crate) fn read(bytes: &'a [u8]) -> Result<Self, ModelError> {
        let broken =
            |e: &dyn std::fmt::Display| ModelError::Metadata { path: "template.json".into(), problem: e.to_string() };
        let mut archive = ZipArchive::new(Cursor::new(bytes)).map_err(|e| broken(&e))?;
        let table = archive.by_name("template.json").map_err(|e| broken(&e))?;
        let table = serde_json::from_reader(table).map_err(|e| broken(&e))?;
        Ok(Self { table, archive })
    }

    /// Names of the graphs that it makes.
    #[cfg(test)]
    pub(super) fn files(&self) -> Result<std::collections::BTreeSet<String>, ModelError> {
        Ok(self.archive.file_names().flatten().map(|n| n.into_owned()).filter(|n| n != "template.json").collect())
    }

    /// Fills the graphs with the weights of a checkpoint and writes them into `folder`, the `description` last. Writes
    /// all files or none. `progress` receives the number of weights written and their total, and returns false to
    /// cancel.
    pub(crate) fn fill(
        &mut self,
        checkpoint: &Path,
        folder: &Path,
        description: &str,
        progress: &mut dyn FnMut(u64, u64) -> bool,
    ) -> Result<(), ModelError> {
        let refused = |e: WeightFileError| ModelError::Metadata { path: checkpoint.into(), problem: e.to_string() };
        let mut weights = WeightFile::open(checkpoint).map_err(refused)?;
        let root = self.root(&weights);
        self.check(&weights, root).map_err(refused)?;
        std::fs::create_dir_all(folder).map_err(|e| failed(folder, e))?;
        // Written to a temporary folder first, so that a failure or a cancel leaves nothing behind.
        let held = temporary_folder(folder, description).map_err(|e| failed(folder, e))?;
        let draft = held.folder.path();
        let all = self.table.weights.values().map(|w| w.len() as u64).sum();
        let (mut done, mut about) = (0, self.table.description.clone());
        let mut files = Vec::new();
        for (role, rows) in &self.table.weights {
            let name = about["graphs"][role]["file"].as_str().unwrap_or_default().to_owned();
            let path = draft.join(&name);
            let mut graph = Vec::new();
            let mut found = self.archive.by_name(&name).map_err(io::Error::other).map_err(|e| failed(&path, e))?;
            found.read_to_end(&mut graph).map_err(|e| failed(&path, e))?;
            let file = File::create(&path).map_err(|e| failed(&path, e))?;
            let mut out = Summed::new(BufWriter::new(file));
            out.write_all(&graph).map_err(|e| failed(&path, e))?;
            for (weight, tensor, shape) in rows {
                let numbers = weights.floats(&format!("{root}{tensor}")).map_err(refused)?;
                write_weight(&mut out, weight, shape, &numbers).map_err(|e| failed(&path, e))?;
                done += 1;
                if !progress(done, all) {
                    return Err(ModelError::Cancelled);
                }
            }
            out.flush().and_then(|()| out.to.get_ref().sync_all()).map_err(|e| failed(&path, e))?;
            about["graphs"][role]["bytes"] = out.bytes.into();
            about["graphs"][role]["sha256"] = hex(&out.sum.finalize()).into();
            files.push(name);
        }
        for (field, tensor) in &self.table.values {
            about.insert(field.clone(), json!(weights.floats(&format!("{root}{tensor}")).map_err(refused)?));
        }
        let source = super::fetch::sha256(checkpoint).map_err(|e| failed(checkpoint, e))?;
        about.insert("checkpoint_sha256".into(), source.into());
        put_in_place(draft, folder, files, description, &Value::Object(about))
    }

    /// Finds the prefix of the checkpoint under which most of the tensors lie.
    fn root(&self, weights: &WeightFile) -> &'static str {
        let found = |root: &&str| {
            self.table.tensors.keys().filter(|t| weights.tensors.contains_key(&format!("{root}{t}"))).count()
        };
        // `max_by_key` returns the last of equals, so the order is reversed.
        ROOTS.into_iter().rev().max_by_key(found).unwrap_or_default()
    }

    /// Checks that the checkpoint has the expected tensors, with their shapes, and no others.
    fn check(&self, weights: &WeightFile, root: &str) -> Result<(), WeightFileError> {
        let refused = |name: &str, problem: String| Err(WeightFileError::Tensor { name: name.into(), problem });
        for (tensor, shape) in &self.table.tensors {
            let name = format!("{root}{tensor}");
            match weights.tensors.get(&name) {
                None => return refused(&name, "is missing; it is the checkpoint of another model".into()),
                Some(stored) if stored.shape != *shape => {
                    let got = &stored.shape;
                    return refused(
                        &name,
                        format!("has the shape {got:?}, not {shape:?}; it is that of another model"),
                    );
                }
                Some(stored) if !stored.dtype.is_float() => {
                    return refused(&name, "has whole numbers where fractions are expected".into());
                }
                Some(_) => {}
            }
        }
        for name in weights.tensors.keys() {
            let Some(tensor) = name.strip_prefix(root) else { continue };
            let is_setting = tensor.rsplit('.').next().is_some_and(|last| SETTINGS.contains(&last));
            if !is_setting && !self.table.tensors.contains_key(tensor) && !self.table.unused.iter().any(|t| t == tensor)
            {
                return refused(name, "is unknown to this model; it is the checkpoint of another one".into());
            }
        }
        Ok(())
    }
}

/// Moves files out of their `draft` folder, then writes their description: without it, they count as missing.
pub(super) fn put_in_place(
    draft: &Path,
    folder: &Path,
    mut files: Vec<String>,
    description: &str,
    about: &Value,
) -> Result<(), ModelError> {
    let path = draft.join(description);
    std::fs::write(&path, format!("{about:#}\n")).map_err(|e| failed(&path, e))?;
    files.push(description.to_owned());
    for name in files {
        let to = folder.join(&name);
        std::fs::rename(draft.join(&name), &to).map_err(|e| failed(&to, e))?;
    }
    Ok(())
}

pub(super) fn failed(path: &Path, e: io::Error) -> ModelError {
    ModelError::File(write_error(path, e))
}

/// Writes a model with a single weight: `ModelProto.graph.initializer` of ONNX.
fn write_weight(out: &mut dyn Write, name: &str, shape: &[u64], numbers: &[f32]) -> io::Result<()> {
    // Field numbers with their wire type: a number, or a length and so many bytes.
    const GRAPH: u8 = 7 << 3 | 2;
    const INITIALIZER: u8 = 5 << 3 | 2;
    const DIMS: u8 = 1 << 3;
    const DATA_TYPE: u8 = 2 << 3;
    const NAME: u8 = 8 << 3 | 2;
    const RAW_DATA: u8 = 9 << 3 | 2;
    const FLOAT: u8 = 1;
    let raw = size_of_val(numbers);
    let mut tensor = Vec::new();
    for length in shape {
        tensor.push(DIMS);
        push_varint(&mut tensor, *length);
    }
    tensor.extend([DATA_TYPE, FLOAT, NAME]);
    push_varint(&mut tensor, name.len() as u64);
    tensor.extend(name.as_bytes());
    tensor.push(RAW_DATA);
    push_varint(&mut tensor, raw as u64);
    let mut inner = vec![INITIALIZER];
    push_varint(&mut inner, (tensor.len() + raw) as u64);
    let mut head = vec![GRAPH];
    push_varint(&mut head, (inner.len() + tensor.len() + raw) as u64);
    for bytes in [&head, &inner, &tensor] {
        out.write_all(bytes)?;
    }
    for some in numbers.chunks(1 << 14) {
        let bytes: Vec<u8> = some.iter().flat_map(|v| v.to_le_bytes()).collect();
        out.write_all(&bytes)?;
    }
    Ok(())
}

/// Appends a number, seven bits a byte, the lowest first; all bytes but the last have the highest bit set.
fn push_varint(bytes: &mut Vec<u8>, mut value: u64) {
    while value >= 0x80 {
        bytes.push(value as u8 | 0x80);
        value >>= 7;
    }
    bytes.push(value as u8);
}
