//! Frames of H.264 by openh264.

use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

use openh264::OpenH264API;
use openh264::decoder::{DecodedYUV, Decoder, DecoderConfig, Flush};
use openh264::formats::YUVSource;
use shiguredo_mp4::bitstream::h264::{LengthSize, length_prefixed_to_annexb};

use super::index::VideoIndex;
use super::{FootageError, FramePixels, VideoFrame, YuvView};
use crate::io::{IoError, files};

/// Decodes all frames; returns their number.
pub(super) fn visit<E: From<FootageError>>(
    path: &Path,
    index: &VideoIndex,
    visit: &mut dyn FnMut(usize, &VideoFrame<'_>) -> Result<(), E>,
) -> Result<usize, E> {
    let failed = |frame: usize, reason: String| FootageError::Decoder { path: path.into(), frame, reason };
    let unread = |cause| FootageError::from(IoError::Read { path: path.into(), cause });
    let length = match index.length_bytes {
        1 => LengthSize::OneByte,
        2 => LengthSize::TwoBytes,
        _ => LengthSize::FourBytes,
    };
    let mut file = files::open(path).map_err(FootageError::from)?;
    // Frames come out in the order in which they are shown, not in that in which they are stored.
    let config = DecoderConfig::new().flush_after_decode(Flush::NoFlush);
    let decoder = Decoder::with_api_config(OpenH264API::from_source(), config);
    let mut decoder = decoder.map_err(|e| failed(1, e.to_string()))?;
    let mut shown = 0;
    let mut show = |decoded: &DecodedYUV<'_>| {
        let (u_row, v_row) = (decoded.strides().1, decoded.strides().2);
        let view = YuvView {
            planes: [decoded.y(), decoded.u(), decoded.v()],
            rows: [decoded.strides().0, u_row, v_row],
            size_px: decoded.dimensions(),
        };
        let frame = VideoFrame { pixels: FramePixels::Yuv(view), turn: index.turn };
        visit(shown, &frame).map(|()| shown += 1)
    };
    for (i, sample) in index.samples.iter().enumerate() {
        // Sizes are within the file, as the index was checked.
        let mut bytes = vec![0; sample.bytes as usize];
        file.seek(SeekFrom::Start(sample.offset)).map_err(unread)?;
        file.read_exact(&mut bytes).map_err(unread)?;
        let units = length_prefixed_to_annexb(&bytes, length).map_err(|e| failed(i + 1, e.to_string()))?;
        let is_start = i == 0 || sample.is_key;
        let packet = if is_start { [index.parameters.as_slice(), &units].concat() } else { units };
        if let Some(decoded) = decoder.decode(&packet).map_err(|e| failed(i + 1, e.to_string()))? {
            show(&decoded)?;
        }
    }
    let last = index.samples.len();
    for decoded in decoder.flush_remaining().map_err(|e| failed(last, e.to_string()))? {
        show(&decoded)?;
    }
    Ok(shown)
}
