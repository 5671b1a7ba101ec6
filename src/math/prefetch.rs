//! Hints to the processor on memory that will be read soon, for accesses that it cannot predict.

/// Starts to fetch a value that is read some steps later. Affects nothing but time.
#[inline(always)]
#[allow(unsafe_code, reason = "the instruction has no safe form")]
pub(crate) fn prefetch<T>(value: &T) {
    // SAFETY: a prefetch of any address reads and writes nothing; this one is valid besides.
    #[cfg(target_arch = "x86_64")]
    unsafe {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        _mm_prefetch::<_MM_HINT_T0>(std::ptr::from_ref(value).cast());
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = value;
}

#[cfg(test)]
mod tests {
    #[test]
    fn what_is_fetched_stays_as_it_is() {
        let value = [3_u8; 100];
        super::prefetch(&value[99]);
        assert_eq!(value, [3; 100]);
    }
}
