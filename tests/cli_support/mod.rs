//! Runs the real binary, and makes small inputs for it.
#![allow(dead_code)]

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader};
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::{Arc, Mutex};

/// A finished run of `fmlgs`.
pub struct Done {
    /// Exit code; `None` if a signal ended it.
    pub code: Option<i32>,
    /// Standard output.
    pub stdout: String,
    /// Standard error.
    pub stderr: String,
}

impl Done {
    /// Panics with the output unless the run succeeded.
    #[track_caller]
    pub fn ok(self) -> Self {
        self.ended_with(0)
    }

    /// Panics with the output unless the run ended with `code`.
    #[track_caller]
    pub fn fails_with(self, code: i32) -> Self {
        self.ended_with(code)
    }

    #[track_caller]
    fn ended_with(self, code: i32) -> Self {
        assert_eq!(self.code, Some(code), "stdout:\n{}\nstderr:\n{}", self.stdout, self.stderr);
        self
    }

    /// Standard output as JSON.
    #[track_caller]
    pub fn json(&self) -> serde_json::Value {
        serde_json::from_str(&self.stdout).unwrap_or_else(|e| panic!("{e} in:\n{}", self.stdout))
    }
}

impl From<Output> for Done {
    fn from(output: Output) -> Self {
        Self {
            code: output.status.code(),
            stdout: String::from_utf8_lossy(&output.stdout).into_owned(),
            stderr: String::from_utf8_lossy(&output.stderr).into_owned(),
        }
    }
}

/// The binary with arguments, without a display or a terminal.
pub fn command(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_fmlgs"));
    command.args(arguments).env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY").stdin(Stdio::null());
    command
}

/// Runs the binary to its end.
pub fn fmlgs(arguments: &[&str]) -> Done {
    command(arguments).output().expect("the binary starts").into()
}

/// A folder that is removed at the end.
pub fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("temporary folder")
}

/// Writes a splat of three bright Gaussians in INRIA's layout, by hand.
pub fn tiny_splat(path: &Path) -> PathBuf {
    let properties = "x y z f_dc_0 f_dc_1 f_dc_2 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3";
    let mut file = b"ply\nformat binary_little_endian 1.0\nelement vertex 3\n".to_vec();
    for name in properties.split(' ') {
        file.extend_from_slice(format!("property float {name}\n").as_bytes());
    }
    file.extend_from_slice(b"end_header\n");
    for (x, color) in [(-1.0_f32, [1.5_f32, -1.0, -1.0]), (0.0, [-1.0, 1.5, -1.0]), (1.0, [-1.0, -1.0, 1.5])] {
        let values = [x, 0.5 * x, 0.2 * x, color[0], color[1], color[2], 4.0, -1.0, -1.2, -1.4, 1.0, 0.1, 0.0, 0.0];
        file.extend(values.iter().flat_map(|v| v.to_le_bytes()));
    }
    std::fs::write(path, file).expect("write the splat");
    path.to_owned()
}

/// Writes a scene of three colored boxes as .glb, each under its own named node, by hand.
pub fn tiny_glb(path: &Path) -> PathBuf {
    let corners: Vec<[f32; 3]> = (0..8).map(|i| [i & 1, i >> 1 & 1, i >> 2 & 1].map(|b| b as f32 - 0.5)).collect();
    let faces: [[u16; 4]; 6] = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let indices: Vec<u16> = faces.iter().flat_map(|f| [f[0], f[1], f[2], f[0], f[2], f[3]]).collect();
    let mut binary: Vec<u8> = corners.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
    binary.extend(indices.iter().flat_map(|i| i.to_le_bytes()));
    let colors = [[0.8, 0.1, 0.1], [0.1, 0.7, 0.2], [0.15, 0.2, 0.8]];
    let places = [[-0.8, 0.5, 0.0], [0.3, 0.5, 0.7], [0.6, 0.5, -0.7]];
    let material =
        |c: &[f64; 3]| serde_json::json!({"pbrMetallicRoughness": {"baseColorFactor": [c[0], c[1], c[2], 1.0]}});
    let mesh =
        |i: usize| serde_json::json!({"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": i}]});
    let node = |i: usize| serde_json::json!({"name": format!("box {i}"), "mesh": i, "translation": places[i]});
    let json = serde_json::json!({
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0, 1, 2]}],
        "nodes": (0..3).map(node).collect::<Vec<_>>(),
        "meshes": (0..3).map(mesh).collect::<Vec<_>>(),
        "materials": colors.iter().map(material).collect::<Vec<_>>(),
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3", "min": [-0.5, -0.5, -0.5], "max": [0.5, 0.5, 0.5]},
            {"bufferView": 1, "componentType": 5123, "count": 36, "type": "SCALAR"},
        ],
        "bufferViews": [{"buffer": 0, "byteLength": 96}, {"buffer": 0, "byteOffset": 96, "byteLength": 72}],
        "buffers": [{"byteLength": binary.len()}],
    });
    let mut json = json.to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut file = b"glTF".to_vec();
    let total = 12 + 8 + json.len() + 8 + binary.len();
    let word = |file: &mut Vec<u8>, v: usize| file.extend((v as u32).to_le_bytes());
    word(&mut file, 2);
    word(&mut file, total);
    word(&mut file, json.len());
    file.extend_from_slice(b"JSON");
    file.extend_from_slice(&json);
    word(&mut file, binary.len());
    file.extend_from_slice(b"BIN\0");
    file.extend_from_slice(&binary);
    std::fs::write(path, file).expect("write the scene");
    path.to_owned()
}

/// A small synthetic dataset of 16 photos, made with `fmlgs synth` in `folder/photos`.
pub fn tiny_dataset(folder: &Path) -> PathBuf {
    let glb = tiny_glb(&folder.join("boxes.glb"));
    let photos = folder.join("photos");
    let (glb, out) = (glb.to_str().unwrap(), photos.to_str().unwrap());
    fmlgs(&[
        "synth",
        glb,
        "--out",
        out,
        "--view-count",
        "16",
        "--size",
        "64x48",
        "--samples",
        "1",
        "--points",
        "500",
        "-q",
    ])
    .ok();
    photos
}

/// Copies into `folder` what the first version left there: `photos`, and `scene`, trained on them for 9 of 80 steps,
/// with its objects. Returns the photos' folder.
pub fn first_version(folder: &Path) -> PathBuf {
    copy(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/first_version"), folder);
    folder.join("photos")
}

/// Copies a folder with all that is in it.
pub fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap() {
        let (path, to) = (entry.as_ref().unwrap().path(), to.join(entry.unwrap().file_name()));
        if path.is_dir() {
            copy(&path, &to);
        } else {
            std::fs::copy(&path, &to).unwrap();
        }
    }
}

/// All files below a folder, by their paths from it, with their contents.
pub fn files_in(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut all = BTreeMap::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = Path::new(path.file_name().unwrap());
        if path.is_dir() {
            all.extend(files_in(&path).into_iter().map(|(inner, bytes)| (name.join(inner), bytes)));
        } else {
            all.insert(name.to_path_buf(), std::fs::read(&path).unwrap());
        }
    }
    all
}

/// A server on this machine.
pub struct Server {
    /// Host and port.
    pub at: String,
    /// The heads of the requests that came.
    pub seen: Arc<Mutex<Vec<String>>>,
}

impl Server {
    /// `answer` gets each connection with the head of its request.
    pub fn new(answer: impl Fn(&mut TcpStream, &str) + Send + Sync + 'static) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let at = listener.local_addr().expect("bound").to_string();
        let (seen, answer) = (Arc::<Mutex<Vec<String>>>::default(), Arc::new(answer));
        let log = Arc::clone(&seen);
        let serve = move || {
            for mut stream in listener.incoming().flatten() {
                let (answer, log) = (Arc::clone(&answer), Arc::clone(&log));
                let talk = move || {
                    let lines = BufReader::new(stream.try_clone().expect("a copy")).lines();
                    let head: Vec<String> = lines.map_while(Result::ok).take_while(|l| !l.is_empty()).collect();
                    let head = head.join("\n");
                    log.lock().expect("log").push(head.clone());
                    answer(&mut stream, &head);
                };
                std::thread::Builder::new().name("connection".into()).spawn(talk).expect("a thread");
            }
        };
        std::thread::Builder::new().name("server".into()).spawn(serve).expect("a thread");
        Self { at, seen }
    }

    /// Number of requests so far.
    pub fn requests(&self) -> usize {
        self.seen.lock().expect("log").len()
    }
}

/// Returns whether a text holds a character that acts on a terminal, or on the order of letters.
pub fn acts(text: &str) -> bool {
    let of_direction = |c| matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    text.chars().any(|c| (c.is_control() && c != '\n' && c != '\t') || of_direction(c))
}
