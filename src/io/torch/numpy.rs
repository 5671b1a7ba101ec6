//! Single numbers of NumPy in a pickle: a type and a few bytes.

use super::parts::Value;

/// Returns the number of a type (`f8`, `i4`) with these bytes; Python's pickles of bytes may be text, a byte per letter.
/// `None` if the bytes do not fit the type, or it is none of numbers.
pub(super) fn number(code: &str, bytes: &Value) -> Option<Value> {
    let bytes: Vec<u8> = match bytes {
        Value::Bytes(bytes) if bytes.len() <= 8 => bytes.to_vec(),
        Value::Text(text) if text.len() <= 16 => text.chars().map(|c| u8::try_from(c).ok()).collect::<Option<_>>()?,
        _ => return None,
    };
    let single = |b: &[u8]| Some(f64::from(f32::from_le_bytes(b.try_into().ok()?)));
    let mut whole = [0; 8];
    whole.get_mut(..bytes.len())?.copy_from_slice(&bytes);
    let natural = u64::from_le_bytes(whole);
    let unused = 64 - 8 * bytes.len() as u32;
    let size = code.get(1..)?.parse::<usize>().ok()?;
    if size != bytes.len() || size == 0 {
        return None;
    }
    Some(match code.get(..1)? {
        "f" if size == 8 => Value::Float(f64::from_le_bytes(whole)),
        "f" if size == 4 => Value::Float(single(&bytes)?),
        "f" if size == 2 => Value::Float(half::f16::from_bits(natural as u16).to_f64()),
        "i" => Value::Int((natural as i64) << unused >> unused),
        "u" => Value::Int(i64::try_from(natural).ok()?),
        "b" if size == 1 => Value::Bool(natural != 0),
        _ => return None,
    })
}
