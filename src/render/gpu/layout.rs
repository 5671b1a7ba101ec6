//! Structures that the host and the shaders share, each with the offsets of its fields, so that
//! a test can hold them against the shaders' own.

use bytemuck::{Pod, Zeroable};

/// Bytes of a pixel of a packed picture.
pub(super) const PACKED_BYTES: u32 = 4;
/// Rows of a packed picture begin at multiples of this number of pixels, as copies into textures require.
pub(super) const ROW_PX: u32 = wgpu::COPY_BYTES_PER_ROW_ALIGNMENT / PACKED_BYTES;

/// A structure's memory layout.
#[derive(Clone, Copy, Debug)]
pub struct Twin {
    /// Its name, here and in WGSL.
    pub name: &'static str,
    /// Size in bytes.
    pub size: usize,
    /// Names and byte offsets of its fields, in order.
    pub fields: &'static [(&'static str, usize)],
}

macro_rules! twins {
    ($($(#[$meta:meta])* struct $name:ident { $($(#[$field_meta:meta])* $field:ident: $ty:ty,)* })*) => {
        $(
            $(#[$meta])*
            #[allow(missing_docs, reason = "the other fields say what they are")]
            #[repr(C)]
            #[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
            pub struct $name { $($(#[$field_meta])* pub $field: $ty,)* }
        )*
        /// Every structure that the shaders share.
        pub const TWINS: &[Twin] = &[$(
            Twin {
                name: stringify!($name),
                size: size_of::<$name>(),
                fields: &[$((stringify!($field), std::mem::offset_of!($name, $field)),)*],
            },
        )*];
    };
}

twins! {
    /// The camera and the picture; see `shaders/shared/view.wgsl`.
    struct View {
        /// The camera's right axis in the world; the last entry is unused here and below.
        right: [f32; 4],
        down: [f32; 4],
        forward: [f32; 4],
        /// Cloud origin minus camera center, leading part.
        offset_hi: [f32; 4],
        /// The rest of it.
        offset_lo: [f32; 4],
        /// Color behind everything.
        background: [f32; 4],
        focal: [f32; 2],
        principal: [f32; 2],
        /// Smallest viewing tangents at which the projection is linearized.
        tangent_min: [f32; 2],
        /// Largest ones.
        tangent_max: [f32; 2],
        size_px: [u32; 2],
        tiles: [u32; 2],
        gaussians: u32,
        /// Spherical-harmonics degree to use.
        sh_degree: u32,
        /// The one that is stored.
        sh_stored: u32,
        /// (Splat, tile) pairs that fit.
        capacity: u32,
        near: f32,
        /// 1 = anti-aliasing compensation.
        antialias: u32,
        channels: u32,
        /// Variance added to each splat along both picture axes, px².
        blur: f32,
    }

    /// A Gaussian in the picture; see `shaders/shared/splat.wgsl`.
    struct Splat {
        mean: [f32; 2],
        depth: f32,
        /// Peak opacity.
        opacity: f32,
        /// Triangular factor of the inverse covariance.
        factor: [f32; 3],
        /// Largest squared Mahalanobis distance that is drawn.
        reach: f32,
        color: [f32; 3],
        /// 3 sigma along the longer axis in px; 0 = not drawn.
        radius: f32,
    }

    /// One radix pass.
    struct Pass {
        /// Lowest bit of the digit.
        shift: u32,
        /// Index of the counter of pairs.
        counter: u32,
        pad0: u32,
        pad1: u32,
    }

    /// Extra channels of a blending pass.
    struct Chunk {
        channels: u32,
        first: u32,
        /// 1 = there is a gradient with respect to expected depth.
        depth_gradient: u32,
        pad0: u32,
    }

    /// One evaluation of the training loss; see `shaders/ssim.wgsl`.
    struct Loss {
        size_px: [u32; 2],
        /// Place in the ring of sums.
        slot: u32,
        /// Tiles of the picture.
        tiles: u32,
        /// Weight of L1 over the number of pixels and channels.
        l1: f32,
        /// Weight of D-SSIM, likewise.
        dssim: f32,
        /// 1 if alpha follows the photo's pixels.
        has_alpha: u32,
        pad0: u32,
        /// Color added where the photo is transparent.
        shift: [f32; 4],
    }

    /// One Adam step over one buffer.
    struct AdamStep {
        /// Rate of each float of a record; a rate of 0 leaves the float and its moments alone.
        rates: [[f32; 4]; 7],
        floats: u32,
        stride: u32,
        /// `1 / (1 - beta1^t)`.
        unbias_first: f32,
        /// `1 / (1 - beta2^t)`.
        unbias_second: f32,
        beta_first: f32,
        beta_second: f32,
        /// Added to the root of the second moment.
        epsilon: f32,
        /// Largest size of a gradient.
        clip: f32,
        /// Square of the largest gradient in units of the second moment.
        growth: f32,
        /// A gradient this many times too large is counted.
        outlier: f32,
        /// Floats at the front that stay as they are.
        frozen: u32,
        pad0: f32,
    }
}

/// Counters of one frame, in the order of `shaders/shared/counters.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct Counters {
    pub(crate) gaussians: u32,
    /// (Splat, tile) pairs blended; 0 when they did not fit.
    pub pairs: u32,
    /// Pairs that the frame needs.
    pub wanted: u32,
    /// 1 when they did not fit.
    pub(crate) overflow: u32,
    /// Gaussians drawn.
    pub(crate) visible: u32,
    /// Gaussians left out because their shape is degenerate.
    pub degenerate: u32,
    /// Gaussians whose gradient was not finite.
    pub(crate) bad_gradients: u32,
    pub(crate) pad: u32,
}
