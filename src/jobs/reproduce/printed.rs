//! Printed values of the paper, and of ReferSplat's: rows of tables, in percent and seconds, to stand beside ours.

use super::PaperTable;

/// A printed table.
pub(super) struct PrintedTable {
    pub(super) metric: &'static str,
    /// Title of the table in the paper, or its source.
    pub(super) title: &'static str,
    /// Its columns by the names of the scenes' folders; the last is for all scenes.
    pub(super) scenes: &'static [&'static str],
    pub(super) rows: &'static [(&'static str, &'static [f64])],
}

/// Metric of a printed table without one of ours.
pub(super) const TIME: &str = "query time, s";
pub(super) const LOCALIZATION: &str = "localization accuracy, %";
pub(super) const MIOU: &str = "mean IoU, %";
pub(super) const ACCURACY: &str = "pixel accuracy, %";
pub(super) const RECALL: &str = "recall of parts, %";

const LERF_SCENES: &[&str] = &["ramen", "figurines", "teatime", "waldo_kitchen"];

/// Returns the printed tables that are reproduced.
pub(super) fn printed(table: PaperTable) -> Vec<PrintedTable> {
    match table {
        PaperTable::LerfOvs => vec![
            PrintedTable {
                metric: LOCALIZATION,
                title: "Quantitative Results of localization accuracy on LERF dataset",
                scenes: LERF_SCENES,
                rows: &[
                    ("LERF", &[61.9, 75.5, 84.8, 70.2, 73.1]),
                    ("LEGaussians", &[78.6, 73.7, 85.6, 90.1, 82.0]),
                    ("LangSplat", &[73.2, 80.4, 88.1, 95.5, 84.3]),
                    ("FastLGS", &[84.2, 91.4, 95.0, 94.7, 91.3]),
                    ("FMLGS", &[89.2, 94.3, 96.7, 96.2, 94.1]),
                ],
            },
            PrintedTable {
                metric: MIOU,
                title: "Quantitative Results of mIoU scores (%) on LERF dataset",
                scenes: LERF_SCENES,
                rows: &[
                    ("LERF", &[28.2, 38.6, 45.0, 37.9, 37.4]),
                    ("LEGaussians", &[34.2, 47.2, 58.6, 50.1, 47.5]),
                    ("LangSplat", &[51.2, 44.7, 65.1, 44.5, 51.4]),
                    ("FastLGS", &[56.2, 61.4, 59.3, 48.5, 56.4]),
                    ("FMLGS", &[73.2, 72.4, 81.8, 64.3, 72.9]),
                ],
            },
        ],
        PaperTable::SpinNerf => {
            let title = "Quantitative Results on SPIn-NeRF dataset";
            let of = |metric, rows| PrintedTable { metric, title, scenes: &[], rows };
            vec![
                of(
                    MIOU,
                    &[
                        ("SAM(2D)", &[95.7]),
                        ("MVSeg", &[89.5]),
                        ("SA3D", &[90.9]),
                        ("LERF", &[81.0]),
                        ("LEGaussians", &[89.3]),
                        ("LangSplat", &[92.2]),
                        ("FastLGS", &[93.1]),
                        ("FMLGS", &[94.2]),
                    ],
                ),
                of(
                    ACCURACY,
                    &[
                        ("SAM(2D)", &[99.2]),
                        ("MVSeg", &[94.6]),
                        ("SA3D", &[97.4]),
                        ("LERF", &[85.2]),
                        ("LEGaussians", &[94.7]),
                        ("LangSplat", &[98.1]),
                        ("FastLGS", &[98.3]),
                        ("FMLGS", &[98.7]),
                    ],
                ),
                of(
                    TIME,
                    &[
                        ("SAM(2D)", &[0.05]),
                        ("LERF", &[30.2]),
                        ("LEGaussians", &[1.04]),
                        ("LangSplat", &[1.43]),
                        ("FastLGS", &[0.31]),
                        ("FMLGS", &[0.30]),
                    ],
                ),
            ]
        }
        PaperTable::Ovs3d => vec![PrintedTable {
            metric: MIOU,
            title: "Quantitative Results of mIoU scores (%) on 3D-OVS dataset",
            scenes: &["bed", "bench", "room", "sofa"],
            rows: &[
                ("ODISE", &[55.6, 30.1, 53.5, 49.3, 47.1]),
                ("OV-Seg", &[79.8, 88.9, 71.4, 66.1, 76.6]),
                ("3D-OVS", &[89.5, 89.3, 92.8, 74.1, 86.4]),
                ("LERF", &[76.2, 59.1, 56.4, 37.6, 57.3]),
                ("LEGaussians", &[45.7, 47.4, 44.7, 48.2, 46.5]),
                ("LangSplat", &[92.6, 93.2, 94.1, 89.3, 92.3]),
                ("FastLGS", &[94.7, 95.1, 95.3, 90.6, 93.9]),
                ("FMLGS", &[95.7, 96.3, 96.8, 95.2, 96.0]),
            ],
        }],
        PaperTable::PartAblation => {
            let title =
                "Ablation on multilevel extraction (ME), semantic deviation (SD) and multilevel localization (ML)";
            let of = |metric, rows| PrintedTable { metric, title, scenes: &[], rows };
            vec![
                of(RECALL, &[("none", &[1.1]), ("ME", &[5.3]), ("ME + SD", &[41.6]), ("ME + SD + ML", &[66.7])]),
                of(TIME, &[("none", &[0.67]), ("ME", &[0.69]), ("ME + SD", &[0.69]), ("ME + SD + ML", &[0.75])]),
            ]
        }
        PaperTable::RefLerf => vec![PrintedTable {
            metric: MIOU,
            title: "mIoU on Ref-LERF, in ReferSplat (arXiv 2508.08252)",
            scenes: LERF_SCENES,
            rows: &[
                ("Grounded SAM", &[14.1, 16.0, 16.9, 16.2, 15.8]),
                ("LangSplat", &[12.0, 17.9, 7.6, 17.9, 13.9]),
                ("GS-Grouping", &[27.9, 8.6, 14.8, 6.3, 14.4]),
                ("GOI", &[27.1, 16.5, 22.9, 15.7, 20.5]),
                ("ReferSplat", &[35.2, 25.7, 31.3, 24.4, 29.2]),
            ],
        }],
    }
}
