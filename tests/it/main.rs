//! Everything but kernels and windows: library, command line, processes, formats.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod agent_commands;
mod agent_common;
mod agent_llm;
mod agent_tools;
mod architecture;
mod batch;
mod cases;
mod cli_basics;
mod cli_compare;
mod cli_depth;
mod cli_language_features;
mod cli_networks;
mod cli_paths;
mod cli_report;
mod cli_results;
mod cli_round_trip;
#[path = "../cli_support/mod.rs"]
mod cli_support;
mod cli_survival;
#[path = "../common/mod.rs"]
mod common;
mod cpu_gradients;
mod cpu_render;
mod cpu_splats;
#[path = "../gpu_common/mod.rs"]
mod gpu_common;
mod io_formats;
mod io_real_data;
mod kills;
mod mcp;
mod model_catalog;
mod model_fetch;
mod networks;
mod normals;
mod page;
mod page_browser;
mod python;
mod real_relevancy;
mod regions;
mod scene_plan;
mod serve;
mod surfels;
mod worker_contract;
