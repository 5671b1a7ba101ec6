//! Bounded reading, and paths that stay inside their folder.

use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::path::{Component, Path, PathBuf};

use sha2::{Digest, Sha256};

use super::{IoError, memory};
use crate::scene::text;

/// Largest text file (JSON, COLMAP text) in bytes.
pub(crate) const MAX_TEXT_BYTES: u64 = 512 << 20;
pub(crate) const MAX_PICTURE_BYTES: u64 = 256 << 20;

pub(crate) fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(p) if !p.as_os_str().is_empty() => p,
        _ => Path::new("."),
    }
}

/// Makes a rename in `folder` survive a power cut, on systems where folders can be synced.
pub(crate) fn sync_folder(folder: &Path) -> io::Result<()> {
    if cfg!(unix) { std::fs::File::open(folder)?.sync_all() } else { Ok(()) }
}

/// Opens a file for reading, if it is a regular one. Pipes and devices are refused before they are opened: a pipe would
/// block the program and a device has no end. Every file named by a user or by another file is opened here.
pub fn open(path: &Path) -> Result<File, IoError> {
    let failed = |cause| IoError::Read { path: path.into(), cause };
    if !fs::metadata(path).map_err(failed)?.is_file() {
        return Err(IoError::NotAFile { path: path.into() });
    }
    File::open(path).map_err(failed)
}

/// SHA-256 of a regular file, as 64 hexadecimal digits.
pub(crate) fn sha256(path: &Path) -> Result<String, IoError> {
    let mut file = open(path)?;
    let (mut sum, mut bytes) = (Sha256::new(), vec![0; 1 << 16]);
    loop {
        match file.read(&mut bytes) {
            Ok(0) => return Ok(hex(&sum.finalize())),
            Ok(n) => sum.update(&bytes[..n]),
            Err(cause) => return Err(IoError::Read { path: path.into(), cause }),
        }
    }
}

/// Writer that also counts its bytes and computes their SHA-256.
pub(crate) struct Summed<W> {
    pub(crate) to: W,
    pub(crate) sum: Sha256,
    pub(crate) bytes: u64,
}

impl<W: Write> Summed<W> {
    pub(crate) fn new(to: W) -> Self {
        Self { to, sum: Sha256::new(), bytes: 0 }
    }
}

impl<W: Write> Write for Summed<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let n = self.to.write(bytes)?;
        self.sum.update(&bytes[..n]);
        self.bytes += n as u64;
        Ok(n)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.to.flush()
    }
}

/// Bytes as hexadecimal digits.
pub(crate) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Reads the whole file, if it is a regular one of at most `limit` bytes and within [`memory::budget`].
pub(crate) fn read(path: &Path, limit: u64) -> Result<Vec<u8>, IoError> {
    let failed = |cause| IoError::Read { path: path.into(), cause };
    let file = open(path)?;
    let limit = limit.min(memory::budget());
    let over = |bytes| IoError::OverBudget {
        path: path.into(),
        what: "the file",
        bytes,
        limit,
        remedy: "free some memory or use a smaller file",
    };
    let length = file.metadata().map_err(failed)?.len();
    if length > limit {
        return Err(over(length));
    }
    let mut bytes = Vec::with_capacity(length as usize);
    // The file may grow between the check and the read.
    file.take(limit + 1).read_to_end(&mut bytes).map_err(failed)?;
    if bytes.len() as u64 > limit {
        return Err(over(bytes.len() as u64));
    }
    Ok(bytes)
}

/// Reads the first `limit` bytes of a file, or all of a shorter one.
pub(crate) fn read_start(path: &Path, limit: u64) -> Result<Vec<u8>, IoError> {
    let mut bytes = Vec::new();
    let read = open(path)?.take(limit).read_to_end(&mut bytes);
    read.map_err(|cause| IoError::Read { path: path.into(), cause })?;
    Ok(bytes)
}

/// Reads the text of a UTF-8 file of at most [`MAX_TEXT_BYTES`], without a byte order mark.
pub(crate) fn read_text(path: &Path) -> Result<String, IoError> {
    let bytes = read(path, MAX_TEXT_BYTES)?;
    let text = str::from_utf8(without_mark(&bytes, path)?);
    let text = text.map_err(|e| IoError::syntax(path, format!("byte {}", e.valid_up_to()), "not UTF-8 text"))?;
    Ok(text.to_owned())
}

pub(crate) fn read_json<T: serde::de::DeserializeOwned>(path: &Path) -> Result<T, IoError> {
    json(&read(path, MAX_TEXT_BYTES)?, path)
}

/// Parses the bytes of a JSON file; `path` is for errors. Every JSON file is parsed here.
pub(crate) fn json<'a, T: serde::Deserialize<'a>>(bytes: &'a [u8], path: &Path) -> Result<T, IoError> {
    serde_json::from_slice(without_mark(bytes, path)?).map_err(|e| json_error(path, &e))
}

/// Strips the byte order mark that Windows programs put before UTF-8 text.
///
/// # Errors
/// If the file is UTF-16 or UTF-32, which no format read here is.
pub(crate) fn without_mark<'a>(bytes: &'a [u8], path: &Path) -> Result<&'a [u8], IoError> {
    match bytes {
        [0xEF, 0xBB, 0xBF, text @ ..] => Ok(text),
        // With a byte order mark, or without one if every second byte of a plain letter is zero.
        [0xFF, 0xFE, ..] | [0xFE, 0xFF, ..] | [0, 1..=127, ..] | [1..=127, 0, ..] => Err(IoError::syntax(
            path,
            "byte 0",
            "this is UTF-16 text, as PowerShell's '>' and Notepad's 'Unicode' write it; save the file as UTF-8",
        )),
        text => Ok(text),
    }
}

/// Returns whether a name is hidden or one that systems leave everywhere (`._a.jpg`, `.DS_Store`, `__MACOSX`,
/// `Thumbs.db`), so nothing that the user put there.
pub(crate) fn is_debris(name: &str) -> bool {
    let others = ["__MACOSX", "Thumbs.db", "ehthumbs.db", "desktop.ini", "@eaDir"];
    name.starts_with('.') || others.iter().any(|o| name.eq_ignore_ascii_case(o))
}

/// Finds the path `name` below `folder`, ignoring letter case if there is no exact match and a single similar one.
pub(crate) fn called(folder: &Path, name: &str) -> Option<PathBuf> {
    let exact = folder.join(name);
    if exact.exists() {
        return Some(exact);
    }
    name.split('/').try_fold(folder.to_path_buf(), |at, part| {
        let next = at.join(part);
        if next.exists() {
            return Some(next);
        }
        let mut alike = names_in(&at).ok()?.into_iter().filter(|other| other.eq_ignore_ascii_case(part));
        alike.next().filter(|_| alike.next().is_none()).map(|one| at.join(one))
    })
}

/// Lists names in a folder without [debris](is_debris), sorted. Names that are not UTF-8 are skipped.
pub(crate) fn names_in(folder: &Path) -> io::Result<Vec<String>> {
    let mut names = Vec::new();
    for entry in fs::read_dir(folder)? {
        names.extend(entry?.file_name().into_string().ok().filter(|name| !is_debris(name)));
    }
    names.sort();
    Ok(names)
}

/// Makes an error of a JSON error, with its line and column.
pub(crate) fn json_error(path: &Path, e: &serde_json::Error) -> IoError {
    let text = e.to_string();
    let reason = text.rsplit_once(" at line ").map_or(text.as_str(), |(reason, _)| reason);
    IoError::syntax(path, format!("line {} column {}", e.line(), e.column()), reason)
}

/// A path that a dataset's file `source` refers to, relative to the dataset's folder `root`:
/// normalized, with `/` between its parts. Absolute paths and `..` are refused.
pub(crate) fn relative(root: &Path, entry: &str, source: &Path) -> Result<String, IoError> {
    let outside = || IoError::Outside { path: source.into(), entry: entry.into(), folder: root.into() };
    // A backslash parts names on Windows only; refused everywhere, so that a dataset means the
    // same on every system.
    if entry.contains(['\\', '\0']) {
        return Err(outside());
    }
    let mut parts = Vec::new();
    for component in Path::new(entry).components() {
        match component {
            Component::Normal(name) => parts.push(name.to_str().ok_or_else(outside)?),
            Component::CurDir => {}
            Component::ParentDir | Component::RootDir | Component::Prefix(_) => return Err(outside()),
        }
    }
    if parts.is_empty() {
        return Err(outside());
    }
    Ok(parts.join("/"))
}

/// Resolves the symbolic links of `root/entry`, which must stay inside `root`; `None` if the file does not exist.
/// `entry` comes from [`relative`].
pub(crate) fn inside(root: &Path, entry: &str, source: &Path) -> Result<Option<PathBuf>, IoError> {
    let path = root.join(entry);
    let Ok(real) = fs::canonicalize(&path) else { return Ok(None) };
    let real_root = fs::canonicalize(root).map_err(|cause| IoError::Read { path: root.into(), cause })?;
    if !real.starts_with(&real_root) {
        return Err(IoError::Outside { path: source.into(), entry: entry.into(), folder: root.into() });
    }
    Ok(Some(path))
}

/// Refuses a photo name that no file can have. `source` lists it.
pub(crate) fn photo_name(name: &str, source: &Path) -> Result<(), IoError> {
    let most = text::LONGEST_PHOTO_NAME;
    match name.chars().count() {
        length if length > most => Err(IoError::syntax(
            source,
            format!("photo '{}'", text::shortened(name, 40)),
            format!("its name has {length} letters, at most {most} are read; rename the photo"),
        )),
        _ => Ok(()),
    }
}

/// Returns whether a folder holds anything but hidden files such as locks and leftovers of killed processes.
pub(crate) fn holds_something(folder: &Path) -> bool {
    let hidden = |e: &fs::DirEntry| e.file_name().to_string_lossy().starts_with('.');
    fs::read_dir(folder).is_ok_and(|all| all.flatten().any(|e| !hidden(&e)))
}

/// Returns the path without links and `..`, so that one place has one path; as it is if nothing is there.
pub(crate) fn real(path: &Path) -> PathBuf {
    fs::canonicalize(path).unwrap_or_else(|_| path.into())
}

/// Name of a folder for display, also if its path ends in `.` or `..`.
pub(crate) fn folder_name(folder: &Path) -> String {
    let real = real(folder);
    text::name(&real.file_name().unwrap_or(real.as_os_str()).to_string_lossy())
}

/// Returns whether a folder is called as those of any data set are, so that its name says nothing.
pub(crate) fn is_usual_name(name: &str) -> bool {
    const USUAL: [&str; 7] = ["photos", "images", "input", "rgb", "frames", "scene", "undistorted"];
    USUAL.iter().any(|usual| name.eq_ignore_ascii_case(usual))
}

/// Name of a data set for display: that of its folder, or of the folder around it where its own says nothing.
pub(crate) fn data_set_name(root: &Path) -> String {
    let name = folder_name(root);
    if !is_usual_name(&name) {
        return name;
    }
    let real = real(root);
    real.parent().and_then(Path::file_name).map_or(name, |around| text::name(&around.to_string_lossy()))
}

/// Returns the path `now` of something named `earlier` by another version. It is renamed once; if that fails, `earlier`
/// is used.
pub(crate) fn renamed(now: PathBuf, earlier: PathBuf) -> PathBuf {
    if !now.exists() && earlier.exists() && fs::rename(&earlier, &now).is_err() {
        return earlier;
    }
    now
}

/// Copies a file. `failed` gets the path, source or target, that an error belongs to; the system does not report it.
pub(crate) fn copy<E>(from: &Path, to: &Path, failed: impl Fn(&Path, io::Error) -> E) -> Result<(), E> {
    let mut source = fs::File::open(from).map_err(|e| failed(from, e))?;
    let mut target = fs::File::create(to).map_err(|e| failed(to, e))?;
    let mut piece = vec![0; 1 << 20];
    loop {
        match source.read(&mut piece).map_err(|e| failed(from, e))? {
            0 => return target.sync_all().map_err(|e| failed(to, e)),
            n => target.write_all(&piece[..n]).map_err(|e| failed(to, e))?,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_that_leave_the_folder_are_refused() {
        let root = Path::new("/data/scene");
        let source = Path::new("transforms.json");
        for entry in ["../a.png", "images/../../a.png", "/etc/passwd", "", ".", "..\\a.png", "a\0b"] {
            let e = relative(root, entry, source).expect_err(entry);
            assert!(matches!(e, IoError::Outside { .. }), "{entry}: {e}");
        }
        assert_eq!(relative(root, "./images//a.png", source).expect("inside"), "images/a.png");
    }

    #[test]
    fn a_data_set_is_called_by_a_folder_that_says_something() {
        let folder = tempfile::tempdir().expect("folder");
        for (path, name) in [("fox/photos", "fox"), ("fox/Images", "fox"), ("fox", "fox"), ("fox/photos-2", "photos-2")]
        {
            let path = folder.path().join(path);
            fs::create_dir_all(&path).expect("created");
            assert_eq!(data_set_name(&path), name, "{}", path.display());
        }
        assert_eq!(data_set_name(Path::new("/photos")), "photos", "nothing is around it");
    }

    #[cfg(unix)]
    #[test]
    fn symbolic_links_out_of_the_folder_are_refused() {
        let folder = tempfile::tempdir().expect("folder");
        let root = folder.path().join("scene");
        fs::create_dir(&root).expect("create");
        fs::write(folder.path().join("secret.png"), b"x").expect("write");
        fs::write(root.join("inner.png"), b"x").expect("write");
        std::os::unix::fs::symlink("../secret.png", root.join("out.png")).expect("link");
        std::os::unix::fs::symlink("inner.png", root.join("in.png")).expect("link");
        let source = Path::new("transforms.json");
        assert!(matches!(inside(&root, "out.png", source), Err(IoError::Outside { .. })));
        assert!(matches!(inside(&root, "in.png", source), Ok(Some(_))));
        assert!(matches!(inside(&root, "none.png", source), Ok(None)));
    }

    #[test]
    fn byte_order_marks_are_skipped_and_other_encodings_named() {
        let path = Path::new("a.json");
        assert_eq!(json::<Vec<u8>>(b"\xEF\xBB\xBF[1]", path).expect("marked"), [1]);
        assert_eq!(json::<Vec<u8>>(b"[1]", path).expect("plain"), [1]);
        for bytes in [&b"\xFF\xFE[\0"[..], b"\xFE\xFF\0[", b"[\0]\0", b"\0[\0]"] {
            let e = json::<Vec<u8>>(bytes, path).expect_err("UTF-16").to_string();
            assert!(e.contains("UTF-16") && e.contains("save the file as UTF-8"), "{e}");
        }
    }

    #[test]
    fn what_systems_leave_is_no_data() {
        for name in ["._a.jpg", ".DS_Store", "__MACOSX", "Thumbs.db", "thumbs.db", ".hidden.png"] {
            assert!(is_debris(name), "{name}");
        }
        assert!(!is_debris("a._b.jpg") && !is_debris("MACOSX.png"));
    }

    #[test]
    fn only_regular_files_of_bounded_size_are_read() {
        let folder = tempfile::tempdir().expect("folder");
        let file = folder.path().join("a");
        fs::write(&file, [0; 100]).expect("write");
        assert!(matches!(read(&file, 99), Err(IoError::OverBudget { bytes: 100, limit: 99, .. })));
        assert_eq!(read(&file, 100).expect("fits").len(), 100);
        assert!(matches!(read(folder.path(), 100), Err(IoError::NotAFile { .. })));
        #[cfg(unix)]
        {
            let pipe = folder.path().join("pipe");
            let made = std::process::Command::new("mkfifo").arg(&pipe).status().expect("mkfifo");
            assert!(made.success());
            for special in [Path::new("/dev/zero"), &pipe] {
                assert!(matches!(read(special, 100), Err(IoError::NotAFile { .. })), "{}", special.display());
                assert!(matches!(read_start(special, 100), Err(IoError::NotAFile { .. })));
            }
        }
    }
}
