//! H.264 (Baseline, constant quantizer) in MP4.
//!
//! The stream states its colors: BT.709 primaries and matrix, sRGB's transfer curve, limited range. Sides are even: a
//! last odd column or row is left out.

use std::io::{Seek, SeekFrom, Write};
use std::num::NonZeroU32;
use std::path::{Path, PathBuf};

use openh264::OpenH264API;
use openh264::encoder::{
    BitRate, Encoder, EncoderConfig, FrameRate, FrameType, IntraFramePeriod, QpRange, RateControlMode,
    TransferCharacteristics, UsageType, VuiConfig,
};
use openh264::formats::YUVSlices;
use shiguredo_mp4::TrackKind;
use shiguredo_mp4::bitstream::h264::{
    H264NalUnitType, H264SampleEntryConfig, LengthSize, build_avc1_box_from_annexb, parse_annexb_nal_units,
};
use shiguredo_mp4::boxes::SampleEntry;
use shiguredo_mp4::mux::{Mp4FileMuxer, Sample};

use super::yuv::YuvPlanes;
use super::{Result, Sink, VideoFileError, VideoSettings};
use crate::io::atomic::Draft;
use crate::io::error::write_error;

pub(super) struct Mp4 {
    path: PathBuf,
    row_px: usize,
    planes: YuvPlanes,
    encoder: Encoder,
    muxer: Mp4FileMuxer,
    draft: Draft,
    /// Position of the next frame in the file.
    position: u64,
    /// Ticks per second and per frame.
    ticks: (NonZeroU32, u32),
}

impl Mp4 {
    pub(super) fn create(path: &Path, settings: &VideoSettings) -> Result<Self> {
        let encoder = Encoder::with_api_config(OpenH264API::from_source(), config(settings));
        let encoder = encoder.map_err(|e| failed(path, &e))?;
        let muxer = Mp4FileMuxer::new().map_err(|e| failed(path, &e))?;
        let mut draft = Draft::create(path)?;
        let head = muxer.initial_boxes_bytes();
        draft.write_all(head).map_err(|cause| write_error(path, cause))?;
        let even = |px: u32| (px & !1) as usize;
        Ok(Self {
            path: path.into(),
            row_px: settings.width_px as usize,
            planes: YuvPlanes::new(even(settings.width_px), even(settings.height_px)),
            encoder,
            position: head.len() as u64,
            muxer,
            draft,
            ticks: ticks(settings.fps),
        })
    }
}

impl Sink for Mp4 {
    fn push(&mut self, rgb: &[u8]) -> Result<()> {
        let path = &self.path;
        self.planes.fill(rgb, self.row_px);
        let (w, h) = (self.planes.width, self.planes.height);
        let planes = (self.planes.y.as_slice(), self.planes.u.as_slice(), self.planes.v.as_slice());
        let stream = self.encoder.encode(&YUVSlices::new(planes, (w, h), (w, w / 2, w / 2)));
        let stream = stream.map_err(|e| failed(path, &e))?;
        let kind = stream.frame_type();
        if !matches!(kind, FrameType::IDR | FrameType::I | FrameType::P) {
            return Err(failed(path, &format!("a frame of type {kind:?}")));
        }
        let stream = stream.to_vec();
        // The first frame's parameters describe the video.
        let sample_entry = if self.position == self.muxer.initial_boxes_bytes().len() as u64 {
            let config = H264SampleEntryConfig { length_size: LengthSize::FourBytes };
            let described = build_avc1_box_from_annexb(&stream, &config);
            Some(SampleEntry::Avc1(described.map_err(|e| failed(path, &e))?))
        } else {
            None
        };
        let frame = picture(&stream).map_err(|e| failed(path, &e))?;
        self.draft.write_all(&frame).map_err(|cause| write_error(path, cause))?;
        let sample = Sample {
            track_kind: TrackKind::Video,
            sample_entry,
            keyframe: kind == FrameType::IDR,
            timescale: self.ticks.0,
            duration: self.ticks.1,
            composition_time_offset: None,
            data_offset: self.position,
            data_size: frame.len(),
        };
        self.muxer.append_sample(&sample).map_err(|e| failed(path, &e))?;
        self.position += frame.len() as u64;
        Ok(())
    }

    fn finish(self: Box<Self>) -> Result<u64> {
        let Self { path, mut muxer, mut draft, .. } = *self;
        let boxes = muxer.finalize().map_err(|e| failed(&path, &e))?;
        for (at, bytes) in boxes.offset_and_bytes_pairs() {
            let written = draft.seek(SeekFrom::Start(at)).and_then(|_| draft.write_all(bytes));
            written.map_err(|cause| write_error(&path, cause))?;
        }
        Ok(draft.commit()?)
    }
}

/// Converts a frame to MP4's form: each unit after its length in 4 bytes, without the parameter sets, which are in the
/// file's header.
fn picture(stream: &[u8]) -> std::result::Result<Vec<u8>, shiguredo_mp4::Error> {
    let mut frame = Vec::with_capacity(stream.len());
    for unit in parse_annexb_nal_units(stream)? {
        if !matches!(unit.nal_unit_type, H264NalUnitType::Sps | H264NalUnitType::Pps) {
            frame.extend_from_slice(&(unit.data.len() as u32).to_be_bytes());
            frame.extend_from_slice(unit.data);
        }
    }
    Ok(frame)
}

fn config(settings: &VideoSettings) -> EncoderConfig {
    // openh264 takes 1 to 60 here; the file's times are the muxer's.
    let rate = settings.fps.clamp(1.0, 60.0) as f32;
    // Chooses the level only: the quantizer is fixed. Half a bit per pixel is plenty.
    let pixels = f64::from(settings.width_px) * f64::from(settings.height_px);
    let bits = (0.5 * pixels * f64::from(rate)).clamp(100_000.0, 100_000_000.0) as u32;
    let quantizer = settings.quantizer();
    EncoderConfig::new()
        .usage_type(UsageType::CameraVideoRealTime)
        // Of the modes, the one that never drops a frame; the quantizer is fixed anyway.
        .rate_control_mode(RateControlMode::Bufferbased)
        .qp(QpRange::new(quantizer, quantizer))
        .skip_frames(false)
        .adaptive_quantization(false)
        .background_detection(false)
        .scene_change_detect(false)
        .max_frame_rate(FrameRate::from_hz(rate))
        .bitrate(BitRate::from_bps(bits))
        // A key frame every two seconds, to which players can seek.
        .intra_frame_period(IntraFramePeriod::from_num_frames((2.0 * settings.fps).ceil() as u32))
        .vui(VuiConfig::bt709().transfer_characteristics(TransferCharacteristics::Srgb))
}

/// Returns ticks per second and per frame of the rate: to a thousandth, or exactly for television's rates (24, 30, 60
/// less a thousandth part).
fn ticks(fps: f64) -> (NonZeroU32, u32) {
    let whole = fps.round();
    let television = (fps * 1.001 - whole).abs() < 1e-3 * fps.min(1.0) && (fps - whole).abs() > 1e-6;
    let (per_sec, per_frame) = if television && fps > 1.0 { (whole * 1000.0, 1001) } else { (fps * 1000.0, 1000) };
    (NonZeroU32::new(per_sec.round() as u32).unwrap_or(NonZeroU32::MIN), per_frame)
}

fn failed(path: &Path, reason: &dyn std::fmt::Display) -> VideoFileError {
    VideoFileError::Encoder { path: path.into(), reason: reason.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_are_exact() {
        for (fps, exact) in [
            (30.0, (30_000, 1000)),
            (25.0, (25_000, 1000)),
            (29.97, (30_000, 1001)),
            (30_000.0 / 1001.0, (30_000, 1001)),
            (23.976, (24_000, 1001)),
            (12.5, (12_500, 1000)),
            (0.01, (10, 1000)),
            (240.0, (240_000, 1000)),
        ] {
            let (per_sec, per_frame) = ticks(fps);
            assert_eq!((per_sec.get(), per_frame), exact, "{fps}");
        }
    }
}
