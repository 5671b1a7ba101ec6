//! Models made from the official files of their authors.

use std::path::Path;

use serde::Deserialize;

use super::catalog::{InstallError, ModelEntry, ModelRole, OfficialFile};
use super::fetch::{self, FetchError, FileToFetch, Part, Timeouts};
use super::template::Template;
use super::{ModelError, manifest, unpack};

/// Name that `progress` receives instead of a file while the weights of a checkpoint are written.
pub(crate) const WEIGHTS: &str = "weights";

/// Endings of checkpoints, and of archives with an engine.
const ENDINGS: [&str; 7] = [".pt", ".pth", ".bin", ".safetensors", ".onnx", ".tgz", ".zip"];

/// Template of a model, if there is one.
fn template(id: &str) -> Option<&'static [u8]> {
    Some(match id {
        "clip-vit-b16" => include_bytes!("../../assets/models/clip-vit-b16.zip"),
        "clip-vit-b32" => include_bytes!("../../assets/models/clip-vit-b32.zip"),
        "clip-vit-b16-openai" => include_bytes!("../../assets/models/clip-vit-b16-openai.zip"),
        "mobile-sam" => include_bytes!("../../assets/models/mobile-sam.zip"),
        "sam-vit-b" => include_bytes!("../../assets/models/sam-vit-b.zip"),
        "sam-vit-h" => include_bytes!("../../assets/models/sam-vit-h.zip"),
        "sam2.1-tiny" => include_bytes!("../../assets/models/sam2.1-tiny.zip"),
        "sam2.1-small" => include_bytes!("../../assets/models/sam2.1-small.zip"),
        "sam2.1-base-plus" => include_bytes!("../../assets/models/sam2.1-base-plus.zip"),
        "sam2.1-large" => include_bytes!("../../assets/models/sam2.1-large.zip"),
        #[cfg(test)]
        "reduced" => include_bytes!("../../tests/fixtures/networks/clip_template.zip"),
        _ => return None,
    })
}

/// Returns whether an address is of a checkpoint, not of a folder.
fn is_checkpoint(address: &str) -> bool {
    ENDINGS.iter().any(|ending| address.ends_with(ending))
}

/// Folder address that replaces the official ones, if `FMLGS_MODELS_FROM` is set.
fn mirror() -> Option<String> {
    std::env::var("FMLGS_MODELS_FROM").ok().filter(|url| !url.is_empty())
}

/// Address of an official file, in the mirror if there is one.
fn in_mirror(url: &str, mirror: Option<&str>) -> String {
    let name = url.rsplit('/').next().unwrap_or_default();
    mirror.map_or_else(|| url.to_owned(), |folder| format!("{}/{name}", folder.trim_end_matches('/')))
}

/// Source checkpoint in the description of a model.
#[derive(Deserialize)]
struct Origin {
    checkpoint_sha256: Option<String>,
}

impl ModelEntry {
    /// Makes it from an official checkpoint or archive of the user, and checks it. `progress` receives the number of
    /// weights written and their total, and returns false to cancel.
    pub fn add_checkpoint(
        &self,
        folder: &Path,
        checkpoint: &Path,
        progress: &mut dyn FnMut(u64, u64) -> bool,
    ) -> Result<(), InstallError> {
        if self.built_in {
            return Err(InstallError::BuiltIn(self.id.clone()));
        }
        if self.role == ModelRole::Engine {
            let library = self.file.first().map_or("", |f| &f.name);
            unpack::library(checkpoint, library, folder, &self.description)?;
            return self.verify(folder);
        }
        if self.role == ModelRole::Inpainter {
            let graph = self.file.first().map_or("", |f| &f.name);
            unpack::graph(checkpoint, graph, folder, &self.description)?;
            return self.verify(folder);
        }
        let template = template(&self.id);
        let template =
            template.ok_or_else(|| InstallError::NoTemplate { id: self.id.clone(), export: self.export.clone() })?;
        Template::read(template)?.fill(checkpoint, folder, &self.description, progress)?;
        self.verify(folder)
    }

    /// Fetches it into `folder` and checks it: its files, or its official checkpoint if it can be made from that.
    /// `from` replaces the listed address: a folder of such files, a folder with such a checkpoint, or a checkpoint.
    /// `progress` receives the file, the bytes so far and the total, and returns false to cancel. While weights are
    /// written it receives [`WEIGHTS`], the number written and their total.
    pub fn fetch(
        &self,
        folder: &Path,
        from: Option<&str>,
        timeouts: Timeouts,
        progress: &mut dyn FnMut(&str, u64, Option<u64>) -> bool,
    ) -> Result<(), InstallError> {
        let mirror = mirror();
        match (&self.checkpoint, from) {
            (Some(official), None) => {
                let address = in_mirror(&official.url, mirror.as_deref());
                self.fetch_checkpoint(official, folder, &address, timeouts, progress)?;
            }
            (Some(official), Some(url)) if is_checkpoint(url) => {
                self.fetch_checkpoint(official, folder, url, timeouts, progress)?;
            }
            (Some(official), Some(_)) => match self.fetch_files(folder, from, timeouts, progress) {
                // A folder may hold the official file instead, under its own name.
                Err(InstallError::Fetch(FetchError::Refused { status: 404, .. })) => {
                    let address = in_mirror(&official.url, from);
                    self.fetch_checkpoint(official, folder, &address, timeouts, progress)?;
                }
                done => done?,
            },
            _ => self.fetch_files(folder, from, timeouts, progress)?,
        }
        if let (Some(known), None) = (&self.known, from) {
            let to = known.picture_in(folder);
            let url = in_mirror(&known.picture, mirror.as_deref());
            let wanted = FileToFetch { url: &url, to: &to, bytes: None, most: fetch::MOST_UNPROMISED, sha256: None };
            if !to.is_file() {
                let once = Timeouts { attempts: 1, ..timeouts };
                // The model works without it; the check reports the missing picture.
                let got = fetch::fetch(&wanted, once, &mut |there, all| progress("picture", there, all));
                if let Err(e @ FetchError::Cancelled { .. }) = got {
                    return Err(e.into());
                }
            }
        }
        Ok(())
    }

    /// Approximate size of its interrupted download on disk, MB.
    pub(crate) fn arrived_megabytes(&self, folder: &Path) -> u64 {
        let Some(official) = &self.checkpoint else { return 0 };
        let to = folder.join(self.checkpoint_name());
        let sha256 = self.checkpoint_sha256(official, folder);
        let wanted = FileToFetch { url: "", to: &to, bytes: None, most: 0, sha256: sha256.as_deref() };
        let whole = std::fs::metadata(&to).map_or(0, |m| m.len());
        whole.max(Part::of(&wanted).there().0) / 1_000_000
    }

    fn checkpoint_name(&self) -> String {
        format!("{}.checkpoint", self.id)
    }

    /// Expected SHA-256 of its checkpoint. Without a published checksum, the first file that was used sets it.
    fn checkpoint_sha256(&self, official: &OfficialFile, folder: &Path) -> Option<String> {
        let description = self.description_in(folder);
        let kind = manifest::kind(&description).ok();
        let origin = kind.and_then(|kind| manifest::read::<Origin>(&description, &kind).ok());
        official.sha256.clone().or_else(|| origin?.checkpoint_sha256)
    }

    /// Fetches its checkpoint, makes the model from it, and removes the checkpoint.
    fn fetch_checkpoint(
        &self,
        official: &OfficialFile,
        folder: &Path,
        url: &str,
        timeouts: Timeouts,
        progress: &mut dyn FnMut(&str, u64, Option<u64>) -> bool,
    ) -> Result<(), InstallError> {
        if self.verify(folder).is_ok() {
            return Ok(());
        }
        let (name, to) = (self.checkpoint_name(), folder.join(self.checkpoint_name()));
        let sha256 = self.checkpoint_sha256(official, folder);
        let most = official.megabytes * 1_100_000;
        let wanted = FileToFetch { url, to: &to, bytes: None, most, sha256: sha256.as_deref() };
        // The file has its final name only once it is whole.
        if !sha256.as_deref().map_or(to.is_file(), |sha256| fetch::check(&to, sha256).is_ok()) {
            // The listed size serves until the server states one.
            let mut bytes = official.megabytes * 1_000_000;
            fetch::fetch(&wanted, timeouts, &mut |there, all| {
                bytes = all.unwrap_or(bytes).max(there);
                progress(&name, there, Some(bytes))
            })?;
        }
        let made = self.add_checkpoint(folder, &to, &mut |done, all| progress(WEIGHTS, done, Some(all)));
        // After a cancel, the checkpoint stays so that it need not be fetched again.
        if !matches!(made, Err(InstallError::Model(ModelError::Cancelled))) {
            // A checkpoint that cannot be removed does no harm.
            let _ = std::fs::remove_file(&to);
        }
        made
    }
}

#[cfg(test)]
mod tests {
    use std::io::{BufRead, BufReader, Write};
    use std::net::TcpListener;
    use std::path::PathBuf;

    use super::*;
    use crate::models::catalog::ModelState;
    use crate::models::fetch::FetchError;

    fn fixture(name: &str) -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/networks").join(name)
    }

    /// Entry of the reduced CLIP, with its checkpoint at an address.
    fn reduced(url: &str) -> ModelEntry {
        let file = |name: &str| serde_json::json!({ "name": name, "megabytes": 1 });
        serde_json::from_value(serde_json::json!({
            "id": "reduced", "role": "encoder", "title": "Reduced", "adds": "Nothing.", "license": "MIT",
            "source": "here", "description": "clip.json", "file": [file("clip_image.onnx"), file("clip_text.onnx")],
            "checkpoint": { "url": url, "megabytes": 1 },
        }))
        .expect("an entry")
    }

    #[test]
    fn a_mirror_has_the_file_under_its_own_name() {
        let url = "https://makers.example/a/b/net.pt";
        assert_eq!(in_mirror(url, None), url);
        assert_eq!(in_mirror(url, Some("http://lab.example/nets/")), "http://lab.example/nets/net.pt");
    }

    /// Serves one file after another, whatever the request; status 404 for an empty name.
    fn server(files: &[&str]) -> String {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let url = format!("http://{}/clip.pt", listener.local_addr().expect("bound"));
        let files: Vec<Vec<u8>> = files.iter().map(|name| std::fs::read(fixture(name)).unwrap_or_default()).collect();
        let serve = move || {
            for bytes in files {
                let Ok((mut stream, _)) = listener.accept() else { return };
                let lines = BufReader::new(stream.try_clone().expect("a stream")).lines();
                let _ = lines.map_while(Result::ok).take_while(|line| !line.is_empty()).count();
                let status = if bytes.is_empty() { "404 Not Found" } else { "200 OK" };
                let head = format!("HTTP/1.1 {status}\r\nContent-Length: {}\r\nConnection: close\r\n\r\n", bytes.len());
                // The client may have closed the connection.
                let _ = stream.write_all(&[head.as_bytes(), &bytes].concat());
            }
        };
        std::thread::Builder::new().name("server".into()).spawn(serve).expect("a thread");
        url
    }

    #[test]
    fn a_checkpoint_is_fetched_and_made_into_a_model() {
        let folder = tempfile::tempdir().expect("folder");
        let entry = reduced(&server(&["clip.pt", "tiny.pt", "clip.pt", "tiny.pt"]));
        let fetch = || entry.fetch(folder.path(), None, Timeouts::default(), &mut |_, _, _| true);
        let names = || {
            let names = std::fs::read_dir(folder.path()).expect("a folder").map(|e| e.expect("a file").file_name());
            let mut names: Vec<String> = names.map(|n| n.to_string_lossy().into_owned()).collect();
            names.sort();
            names
        };
        fetch().expect("fetched");
        assert_eq!(names(), ["clip.json", "clip_image.onnx", "clip_text.onnx"]);
        assert_eq!(entry.state(folder.path()), ModelState::Here);
        // A complete model is not fetched again.
        fetch().expect("here");
        // A broken one is fetched again; a file other than the first is refused.
        std::fs::write(folder.path().join("clip_text.onnx"), "broken").expect("written");
        assert!(matches!(fetch(), Err(InstallError::Fetch(FetchError::Checksum { .. }))));
        assert_eq!(names(), ["clip.json", "clip_image.onnx", "clip_text.onnx"]);
        fetch().expect("mended");
        entry.verify(folder.path()).expect("right");
        // In a new folder, the fourth answer is the first one: a checkpoint of another model.
        let fresh = tempfile::tempdir().expect("folder");
        let error = entry.fetch(fresh.path(), None, Timeouts::default(), &mut |_, _, _| true);
        assert!(error.expect_err("another model").to_string().contains("missing"));
        assert_eq!(std::fs::read_dir(fresh.path()).expect("a folder").count(), 0);
    }

    #[test]
    fn a_folder_with_the_checkpoint_is_as_good_as_one_with_graphs() {
        let (folder, url) = (tempfile::tempdir().expect("folder"), server(&["", "clip.pt", "", ""]));
        let entry = reduced("https://makers.example/clip.pt");
        let from = url.strip_suffix("/clip.pt").expect("a folder");
        let fetch = |folder: &Path| entry.fetch(folder, Some(from), Timeouts::default(), &mut |_, _, _| true);
        fetch(folder.path()).expect("fetched");
        assert_eq!(entry.state(folder.path()), ModelState::Here);
        // The control: neither is there.
        let fresh = tempfile::tempdir().expect("folder");
        let error = fetch(fresh.path()).expect_err("nothing").to_string();
        assert!(error.contains("clip.pt answered 404"), "{error}");
    }

    #[test]
    fn every_listed_checkpoint_has_its_template() {
        let all = crate::models::catalog::entries().expect("the list");
        let mut made = 0;
        for entry in all.into_iter().filter(|e| !matches!(e.role, ModelRole::Engine | ModelRole::Inpainter)) {
            let bytes = template(&entry.id);
            assert_eq!(bytes.is_some(), entry.checkpoint.is_some(), "{}", entry.id);
            let Some(bytes) = bytes else { continue };
            assert!(bytes.len() < 1 << 20, "{}: {} bytes", entry.id, bytes.len());
            let template = Template::read(bytes).expect("reads");
            assert_eq!(template.files().expect("graphs"), entry.file.iter().map(|f| f.name.clone()).collect());
            // Checkpoints of other models are recognized by their tensors, and nothing is left behind.
            let folder = tempfile::tempdir().expect("folder");
            let error = entry.add_checkpoint(&folder.path().join("models"), &fixture("clip.pt"), &mut |_, _| true);
            let error = error.expect_err("the reduced one").to_string();
            assert!(error.contains("clip.pt: its tensor '"), "{error}");
            assert!(!folder.path().join("models").exists());
            made += 1;
        }
        assert!(made >= 10);
        let none =
            reduced("http://127.0.0.1/").add_checkpoint(Path::new("/nowhere"), &fixture("none"), &mut |_, _| true);
        assert!(matches!(none, Err(InstallError::Model(ModelError::Metadata { .. }))));
    }
}
