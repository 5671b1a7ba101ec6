//! `cargo bench`: the same measurements as `fmlgs bench`, on the real inputs where they are there.

use std::path::Path;

use fmlgs::io::{self, Opened};
use fmlgs::pipeline::bench;
use fmlgs::pipeline::observer::Silent;
use fmlgs::pipeline::train::{TrainConfig, load_views};

fn main() {
    let data =
        std::env::var("FMLGS_DATA").unwrap_or_else(|_| concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data").into());
    let limit = bench::one_core_limit();
    println!("one core evaluates {:.2e} splat-pixel products per second", limit);
    for name in
        ["playbot_lod3_sh2_31000.ply", "guitar_sh0_90854.ply", "statue_narcissus_sh0_101275.ply", "playbot_500k_sog"]
    {
        let path = Path::new(&data).join("splats").join(name);
        let cloud = match io::open(&path) {
            Ok(Opened::Cloud(cloud)) => cloud,
            Ok(_) => continue,
            Err(e) => {
                println!("skipped {name}: {e}");
                continue;
            }
        };
        for size in [[640, 480], [1280, 720]] {
            match bench::render(name, &cloud, size, 10) {
                Ok(t) => println!(
                    "{name} {}x{}: {:.1} ms (project {:.1}, sort {:.1}, bin {:.1}, blend {:.1}), {:.2e} products/s, {:.0} % of one core's limit",
                    size[0],
                    size[1],
                    t.total_ms,
                    t.stages_ms[0],
                    t.stages_ms[1],
                    t.stages_ms[2],
                    t.stages_ms[3],
                    t.products_per_sec,
                    100.0 * t.products_per_sec / limit
                ),
                Err(e) => println!("{name}: {e}"),
            }
        }
    }
    for (name, max_side_px) in [("plush_quarter", 252), ("plush", 504)] {
        let Ok(Opened::Dataset(dataset)) = io::open(&Path::new(&data).join(name)) else {
            println!("skipped {name}: not there");
            continue;
        };
        let config = TrainConfig { max_side_px, ..TrainConfig::default() };
        let (train, _) = dataset.split(config.holdout_every);
        match load_views(&dataset, &train, &config, "Loading", &mut Silent) {
            Ok(Some(views)) => match bench::train_steps(&dataset, &views, &config, 40) {
                Ok(t) => println!(
                    "{name} at {}x{}, {} Gaussians: {:.1} ms a step, {:.1} steps/s",
                    t.size[0], t.size[1], t.gaussians, t.step_ms, t.steps_per_sec
                ),
                Err(e) => println!("{name}: {e}"),
            },
            Ok(None) => {}
            Err(e) => println!("{name}: {e}"),
        }
    }
}
