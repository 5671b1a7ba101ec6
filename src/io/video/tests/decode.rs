//! Decoders of every format: `gif`, `image`, and for MP4 `mp4parse` and openh264's decoder.

use std::fs;
use std::io::Cursor;
use std::path::Path;

use image::AnimationDecoder;
use image::codecs::webp::WebPDecoder;
use openh264::decoder::Decoder;
use openh264::formats::YUVSource;

use super::super::Format;

pub(crate) struct Decoded {
    pub(crate) size_px: (u32, u32),
    pub(crate) frames: Vec<Vec<u8>>,
    /// Playing time, if the format stores times.
    pub(crate) secs: Option<f64>,
    pub(crate) bytes: u64,
}

pub(crate) fn decode(path: &Path, format: Format) -> Decoded {
    match format {
        Format::Mp4 => mp4(&fs::read(path).expect("read")),
        Format::Gif => gif(&fs::read(path).expect("read")),
        Format::WebP => webp(&fs::read(path).expect("read")),
        Format::Frames => frames(path),
    }
}

fn without_alpha(rgba: &[u8]) -> Vec<u8> {
    rgba.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect()
}

fn gif(bytes: &[u8]) -> Decoded {
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    let mut decoder = options.read_info(Cursor::new(bytes)).expect("a GIF");
    assert_eq!(decoder.repeat(), gif::Repeat::Infinite);
    let size_px = (u32::from(decoder.width()), u32::from(decoder.height()));
    let (mut frames, mut hundredths) = (Vec::new(), 0);
    while let Some(frame) = decoder.read_next_frame().expect("a frame") {
        assert_eq!((u32::from(frame.width), u32::from(frame.height)), size_px);
        hundredths += u32::from(frame.delay);
        frames.push(without_alpha(&frame.buffer));
    }
    Decoded { size_px, frames, secs: Some(f64::from(hundredths) / 100.0), bytes: bytes.len() as u64 }
}

fn webp(bytes: &[u8]) -> Decoded {
    let decoder = WebPDecoder::new(Cursor::new(bytes)).expect("a WebP");
    assert!(decoder.has_animation());
    let frames = decoder.into_frames().collect_frames().expect("frames");
    let ms = |f: &image::Frame| {
        let (numerator, denominator) = f.delay().numer_denom_ms();
        f64::from(numerator) / f64::from(denominator)
    };
    let secs = frames.iter().map(ms).sum::<f64>() / 1000.0;
    Decoded {
        size_px: frames[0].buffer().dimensions(),
        frames: frames.iter().map(|f| without_alpha(f.buffer())).collect(),
        secs: Some(secs),
        bytes: bytes.len() as u64,
    }
}

fn frames(folder: &Path) -> Decoded {
    let mut paths: Vec<_> = fs::read_dir(folder).expect("list").map(|e| e.expect("entry").path()).collect();
    paths.sort();
    let pictures: Vec<_> = paths.iter().map(|p| image::open(p).expect("a picture").into_rgb8()).collect();
    for (t, path) in paths.iter().enumerate() {
        assert_eq!(path.file_name().expect("name").to_string_lossy(), format!("frame_{t:05}.png"));
    }
    Decoded {
        size_px: pictures[0].dimensions(),
        frames: pictures.into_iter().map(image::RgbImage::into_raw).collect(),
        secs: None,
        bytes: paths.iter().map(|p| fs::metadata(p).expect("size").len()).sum(),
    }
}

fn mp4(bytes: &[u8]) -> Decoded {
    let context = mp4parse::read_mp4(&mut Cursor::new(bytes)).expect("an MP4");
    assert_eq!(context.tracks.len(), 1);
    let track = &context.tracks[0];
    let described = &track.stsd.as_ref().expect("stsd").descriptions[0];
    let mp4parse::SampleEntry::Video(video) = described else { panic!("no video: {described:?}") };
    assert_eq!(video.codec_type, mp4parse::CodecType::H264);
    let mp4parse::VideoCodecSpecific::AVCConfig(avcc) = &video.codec_specific else { panic!("no avcC") };
    let samples = mp4parse::unstable::create_sample_table(track, 0.into()).expect("samples");
    assert!(samples[0].sync, "the first frame is whole");
    let steps: Vec<i64> = samples.windows(2).map(|s| s[1].start_decode.0 - s[0].start_decode.0).collect();
    assert!(steps.iter().all(|s| *s == steps[0]), "a constant rate: {steps:?}");
    assert!(samples.iter().all(|s| s.start_decode == s.start_composition), "no frame is shown late");

    let mut decoder = Decoder::new().expect("decoder");
    let (parameters, vui) = parameters(avcc);
    assert_eq!(vui, "limited range, primaries 1, transfer 13, matrix 1");
    let mut frames = Vec::new();
    let mut stream = parameters;
    for sample in samples.iter() {
        let mut rest = &bytes[sample.start_offset.0 as usize..sample.end_offset.0 as usize];
        while let Some((length, tail)) = rest.split_first_chunk::<4>() {
            let (unit, tail) = tail.split_at(u32::from_be_bytes(*length) as usize);
            assert!(![7, 8].contains(&(unit[0] & 31)), "parameters belong in the head");
            stream.extend([0, 0, 0, 1]);
            stream.extend(unit);
            rest = tail;
        }
        frames.extend(decoder.decode(&stream).expect("decode").map(|f| rgb(&f)));
        stream.clear();
    }
    frames.extend(decoder.flush_remaining().expect("flush").iter().map(rgb));
    let timescale = track.timescale.expect("timescale").0 as f64;
    let secs = Some(track.duration.expect("duration").0 as f64 / timescale);
    let size_px = (u32::from(video.width), u32::from(video.height));
    Decoded { size_px, frames, secs, bytes: bytes.len() as u64 }
}

/// Returns the parameter sets of an `avcC` box as a stream, and a summary of their colors.
fn parameters(avcc: &[u8]) -> (Vec<u8>, String) {
    assert_eq!((avcc[0], avcc[4] & 3), (1, 3), "version 1, lengths of 4 bytes");
    let (mut at, mut stream, mut vui) = (5, Vec::new(), String::new());
    for mask in [31, 255] {
        let count = avcc[at] & mask;
        at += 1;
        assert_eq!(count, 1);
        let length = usize::from(u16::from_be_bytes([avcc[at], avcc[at + 1]]));
        let unit = &avcc[at + 2..at + 2 + length];
        if mask == 31 {
            assert_eq!(&avcc[1..4], &unit[1..4], "profile and level");
            vui = colors(unit);
        }
        stream.extend([0, 0, 0, 1]);
        stream.extend(unit);
        at += 2 + length;
    }
    (stream, vui)
}

struct Bits<'a>(&'a [u8], usize);

impl Bits<'_> {
    fn bits(&mut self, count: usize) -> u32 {
        (0..count).fold(0, |value, _| {
            let bit = self.0[self.1 / 8] >> (7 - self.1 % 8) & 1;
            self.1 += 1;
            value << 1 | u32::from(bit)
        })
    }

    /// Reads an Exp-Golomb number.
    fn number(&mut self) -> u32 {
        let zeros = (0..).take_while(|_| self.bits(1) == 0).count();
        (1 << zeros) - 1 + self.bits(zeros)
    }
}

/// Summarizes the colors in a sequence parameter set of the Baseline profile (H.264, 7.3.2.1.1 and E.1.1).
fn colors(unit: &[u8]) -> String {
    let raw: Vec<u8> =
        (0..unit.len()).filter(|i| !(*i >= 2 && unit[i - 2..=*i] == [0, 0, 3])).map(|i| unit[i]).collect();
    assert_eq!(raw[1], 66, "Baseline");
    let mut b = Bits(&raw, 32);
    b.number(); // seq_parameter_set_id
    b.number(); // log2_max_frame_num
    let order = b.number(); // pic_order_cnt_type
    assert!(order == 0 || order == 2, "order {order}");
    if order == 0 {
        b.number(); // log2_max_pic_order_cnt_lsb
    }
    b.number(); // max_num_ref_frames
    b.bits(1);
    b.number(); // width in macroblocks
    b.number(); // height in macroblocks
    assert_eq!(b.bits(1), 1, "whole frames");
    b.bits(1);
    if b.bits(1) == 1 {
        for _ in 0..4 {
            b.number(); // cropping
        }
    }
    assert_eq!(b.bits(1), 1, "VUI");
    if b.bits(1) == 1 && b.bits(8) == 255 {
        b.bits(32); // aspect ratio
    }
    if b.bits(1) == 1 {
        b.bits(1); // overscan
    }
    assert_eq!(b.bits(1), 1, "video signal type");
    b.bits(3);
    let range = if b.bits(1) == 0 { "limited" } else { "full" };
    assert_eq!(b.bits(1), 1, "color description");
    format!("{range} range, primaries {}, transfer {}, matrix {}", b.bits(8), b.bits(8), b.bits(8))
}

/// Converts from BT.709's limited range; color samples lie on even columns, between rows.
fn rgb(yuv: &openh264::decoder::DecodedYUV) -> Vec<u8> {
    let (width, height) = yuv.dimensions();
    let (y_row, u_row, v_row) = yuv.strides();
    let mut rgb = Vec::new();
    for row in 0..height {
        for column in 0..width {
            let y = (f64::from(yuv.y()[row * y_row + column]) - 16.0) / 219.0;
            // Halfway between two samples in odd columns; the nearest row.
            let right = column.div_ceil(2).min(width / 2 - 1);
            let color = |plane: &[u8], stride: usize| {
                let at = |c: usize| f64::from(plane[row / 2 * stride + c]);
                (0.5 * (at(column / 2) + at(right)) - 128.0) / 224.0
            };
            let (cb, cr) = (color(yuv.u(), u_row), color(yuv.v(), v_row));
            let (r, b) = (y + 1.5748 * cr, y + 1.8556 * cb);
            let g = (y - 0.2126 * r - 0.0722 * b) / 0.7152;
            rgb.extend([r, g, b].map(|v| (v * 255.0).round().clamp(0.0, 255.0) as u8));
        }
    }
    rgb
}
