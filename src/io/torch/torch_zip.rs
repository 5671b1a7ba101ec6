//! Zip archives of `torch.save` and of TorchScript: a pickle of tensors, and an entry of bytes for each storage.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufReader, Read};

use zip::read::ZipFile;
use zip::{CompressionMethod, ZipArchive};

use super::WeightFileError;
use super::parts::{PickleNode, TensorRecord, Value};
use super::pickle;
use super::tensor::{StoragePlace, StoredTensor};
use super::tree::TorchTree;

/// Largest pickle, bytes; those of official files have about 100 kB.
const MOST_PICKLE: u64 = 8 << 20;
/// Most levels of nested dictionaries and modules.
const MOST_DEPTH: usize = 64;
const MOST_TENSORS: usize = 1 << 16;
/// Longest name of a tensor, bytes.
const MOST_NAME: usize = 1 << 10;
/// Most values that are visited in the search for tensors; shared ones count at each visit.
const MOST_VISITS: usize = 1 << 20;

type Archive = ZipArchive<BufReader<File>>;
type Result<T> = std::result::Result<T, WeightFileError>;

/// Opens the archive and reads its list of tensors.
pub(super) fn open(file: File) -> Result<(Archive, BTreeMap<String, StoredTensor>, TorchTree)> {
    let length = file.metadata()?.len();
    let mut archive = ZipArchive::new(BufReader::new(file))?;
    let names = archive.file_names().map(|n| Ok(n?.into_owned())).collect::<Result<Vec<String>>>()?;
    // The folder is named after the file as it was first saved.
    let is_pickle = |name: &&String| name.strip_suffix("/data.pkl").is_some_and(|root| !root.contains('/'));
    let pickled = names.iter().find(is_pickle).ok_or(WeightFileError::Kind)?;
    let root = pickled.trim_end_matches("data.pkl");
    if let Some(i) = archive.index_for_name(&format!("{root}byteorder"))
        && entry(&mut archive, i, 16)? != b"little"
    {
        let problem = "says that its numbers are not little-endian; save it on another machine".into();
        return Err(WeightFileError::Entry { entry: format!("{root}byteorder"), problem });
    }
    let index = archive.index_for_name(pickled).ok_or(WeightFileError::Kind)?;
    let tree = pickle::read(&entry(&mut archive, index, MOST_PICKLE)?)?;
    let mut tensors = BTreeMap::new();
    for (name, record) in records(&tree)? {
        let tensor = stored(&mut archive, root, length, &name, record)?;
        if tensors.insert(name.clone(), tensor).is_some() {
            return Err(WeightFileError::Tensor { name, problem: "is there twice".into() });
        }
    }
    Ok((archive, tensors, tree))
}

/// Reads the bytes of a storage and verifies their checksum.
pub(super) fn storage(archive: &mut Archive, place: StoragePlace) -> Result<Vec<u8>> {
    match place {
        StoragePlace::Entry(i) => entry(archive, i, u64::MAX),
        StoragePlace::Range(..) => Ok(Vec::new()),
    }
}

/// Reads parts of these lengths of a storage, one after the other from the byte `begin`, and verifies its checksum.
pub(super) fn parts(
    archive: &mut Archive,
    place: StoragePlace,
    begin: usize,
    lengths: impl Iterator<Item = usize>,
    each: &mut dyn FnMut(&[u8]),
) -> Result<()> {
    let StoragePlace::Entry(index) = place else { return Ok(()) };
    let (mut file, name) = stored_entry(archive, index, u64::MAX)?;
    let failed = |e: io::Error| WeightFileError::Entry { entry: name.clone(), problem: format!("is damaged: {e}") };
    io::copy(&mut (&mut file).take(begin as u64), &mut io::sink()).map_err(failed)?;
    let mut part = Vec::new();
    for length in lengths {
        part.resize(length, 0);
        file.read_exact(&mut part).map_err(failed)?;
        each(&part);
    }
    // Its checksum is verified at its end.
    io::copy(&mut file, &mut io::sink()).map_err(failed).map(drop)
}

/// Opens an entry of at most `most` bytes. PyTorch does not compress such entries, so none is larger than its file.
fn stored_entry(archive: &mut Archive, index: usize, most: u64) -> Result<(ZipFile<'_, BufReader<File>>, String)> {
    let file = archive.by_index(index)?;
    let entry = file.name().map(|n| n.into_owned()).unwrap_or_default();
    let size = file.size();
    let problem = if file.compression() != CompressionMethod::Stored || file.compressed_size() != size {
        "is compressed, as PyTorch does not do it; save the checkpoint anew there".into()
    } else if size > most {
        format!("has {size} bytes, more than the {most} that are possible")
    } else {
        return Ok((file, entry));
    };
    Err(WeightFileError::Entry { entry, problem })
}

/// Reads an entry of at most `most` bytes.
fn entry(archive: &mut Archive, index: usize, most: u64) -> Result<Vec<u8>> {
    let (mut file, entry) = stored_entry(archive, index, most)?;
    let refused = |problem: String| WeightFileError::Entry { entry: entry.clone(), problem };
    let size = file.size();
    let mut bytes = Vec::new();
    (&mut file).take(size).read_to_end(&mut bytes).map_err(|e| refused(format!("cannot be read: {e}")))?;
    // One more read at the end verifies the checksum.
    let more = file.read(&mut [0; 1]).map_err(|e| refused(format!("is damaged: {e}")))?;
    if bytes.len() as u64 != size || more > 0 {
        return Err(refused(format!("has another size than the {size} bytes that it states")));
    }
    Ok(bytes)
}

/// Finds the storage of a tensor in an archive of `length` bytes.
fn stored(archive: &mut Archive, root: &str, length: u64, name: &str, record: TensorRecord) -> Result<StoredTensor> {
    let failed = |problem: String| WeightFileError::Tensor { name: name.into(), problem };
    let key = &*record.storage;
    if key.is_empty() || !key.bytes().all(|b| b.is_ascii_alphanumeric()) {
        return Err(failed(format!("is stored in '{key}', which is no name of an entry")));
    }
    let path = format!("{root}data/{key}");
    let index = archive.index_for_name(&path);
    let index = index.ok_or_else(|| failed(format!("is stored in '{path}', which is not in the archive")))?;
    let size = archive.by_index_raw(index)?.size();
    if size > length {
        return Err(failed(format!("is stored in '{path}', which states {size} bytes in a file of {length}")));
    }
    if record.elements.checked_mul(record.dtype.bytes()).is_none_or(|bytes| bytes as u64 != size) {
        let (elements, bytes) = (record.elements, record.dtype.bytes());
        return Err(failed(format!("states {elements} numbers of {bytes} bytes, but '{path}' has {size} bytes")));
    }
    let view = (record.shape, record.strides, record.offset);
    StoredTensor::new(record.dtype, view, record.elements, StoragePlace::Entry(index)).map_err(failed)
}

/// Lists all tensors of a pickle by their path of keys, joined by dots.
fn records(tree: &TorchTree) -> Result<Vec<(String, TensorRecord)>> {
    let mut found = Vec::new();
    let mut open = vec![(String::new(), tree.root.clone(), 0)];
    let mut visits = 0;
    // Limits on depth and visits, because a small pickle can describe a cyclic or a huge graph.
    while let Some((name, value, depth)) = open.pop() {
        let Value::Node(node) = value else { continue };
        if depth > MOST_DEPTH {
            return Err(WeightFileError::TooMany { what: "levels", most: MOST_DEPTH });
        }
        let mut below = |key: &str, value: &Value| {
            visits += 1;
            if visits > MOST_VISITS {
                return Err(WeightFileError::TooMany { what: "values", most: MOST_VISITS });
            }
            if name.len() + key.len() > MOST_NAME {
                return Err(WeightFileError::TooMany { what: "letters in a name", most: MOST_NAME });
            }
            let name = if name.is_empty() { key.to_owned() } else { format!("{name}.{key}") };
            open.push((name, value.clone(), depth + 1));
            Ok(())
        };
        match &tree.nodes[node] {
            PickleNode::Tensor(record) if found.len() < MOST_TENSORS => found.push((name, record.clone())),
            PickleNode::Tensor(_) => return Err(WeightFileError::TooMany { what: "tensors", most: MOST_TENSORS }),
            PickleNode::Module(Some(attributes)) => open.push((name, attributes.clone(), depth + 1)),
            PickleNode::Dict(entries) => {
                for (key, value) in entries {
                    match key {
                        Value::Text(key) => below(key, value)?,
                        Value::Int(key) => below(&key.to_string(), value)?,
                        _ => {}
                    }
                }
            }
            PickleNode::List(items) | PickleNode::Tuple(items) => {
                for (i, item) in items.iter().enumerate() {
                    below(&i.to_string(), item)?;
                }
            }
            PickleNode::Global(_)
            | PickleNode::Storage(_)
            | PickleNode::Module(None)
            | PickleNode::NumpyDtype(_)
            | PickleNode::NumpyArray => {}
        }
    }
    Ok(found)
}
