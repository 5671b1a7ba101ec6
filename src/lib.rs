//! FMLGS: train 3D Gaussians from posed photos while you watch, and look around in them.
//!
//! The data flow, one module per arrow (a module uses only those above it):
//!
//! * [`math`]: spherical harmonics, rotations, stable scalar functions, statistics, color maps;
//! * [`scene`]: what a scene is made of: cameras, photos, Gaussians, masks; no I/O;
//! * [`io`]: one file per format, and one `open(path)` that sniffs;
//! * [`models`]: neural networks: pictures and phrases as vectors that can be compared;
//! * [`render`]: the splat renderer, forward and backward, on the CPU and on the GPU;
//! * [`pipeline`]: training, evaluation, synthetic data; reports to an `Observer` only;
//! * [`navigate`]: camera paths through occupied space;
//! * [`measure`]: error against run time, speed, extreme cases: one document, one set of tables;
//! * [`jobs`]: one file per use case, for the window, the command line and the agent;
//! * [`worker`]: the background thread that runs jobs for the window;
//! * [`remote`]: a scene or a training on one computer, the window on another;
//! * [`agent`]: plain sentences become checked calls of a closed set of tools;
//! * [`cli`]: one file per subcommand;
//! * [`ui`]: the window.

pub mod agent;
pub mod cli;
pub mod io;
pub mod jobs;
pub mod math;
pub mod measure;
pub mod models;
pub mod navigate;
pub mod pipeline;
pub mod remote;
pub mod render;
pub mod scene;
pub mod ui;
pub mod worker;
