//! Forward pictures of trained splats: the GPU against the f64 oracle, three views each.

use crate::common::psnr;
use crate::gpu_common::with_context;
use fmlgs::measure::bench::views_of;
use fmlgs::render::gpu::GpuRenderer;
use fmlgs::render::{Features, RenderSettings, cpu};
use fmlgs::scene::Camera;

#[test]
fn trained_splats_on_the_gpu_are_within_60_db_of_the_oracle() {
    with_context(|context| {
        let mut renderer = GpuRenderer::new(context).unwrap();
        for name in ["guitar_sh0_90854.ply", "statue_narcissus_sh0_101275.ply", "playbot_lod3_sh2_31000.ply"] {
            let Some(path) = crate::common::data(&format!("splats/{name}")) else { return };
            let cloud = fmlgs::io::splat_ply::read(&path).expect("a readable splat file");
            let oracle = cloud.cast::<f64>();
            renderer.upload(&cloud, Features::NONE).unwrap();
            for camera in views_of(&cloud, 320, 240) {
                let s = RenderSettings::default();
                let a = cpu::CpuRenderer::new().render(&oracle, Features::NONE, &camera, &s).unwrap();
                let b = renderer.draw(&camera, &s).unwrap();
                let db = psnr(&a.color, &b.color);
                println!("{name}: {db:.1} dB");
                assert!(db > 60.0, "{name}: {db} dB");
                let tilted = Camera { center: camera.center * 1.002, ..camera.clone() };
                let c = renderer.draw(&tilted, &s).unwrap();
                assert!(psnr(&a.color, &c.color) < 60.0, "negative control: another camera");
            }
        }
    });
}
