//! Shapes to select Gaussians with.

/// Way to select Gaussians in the view.
#[derive(Clone, Copy, Debug, Default, PartialEq, strum::VariantArray, strum::IntoStaticStr, strum::Display)]
#[strum(serialize_all = "lowercase")]
pub enum SelectShape {
    /// What belongs together under a click or a line.
    #[default]
    Click,
    /// A known object or part.
    Object,
    /// Gaussians under a brush.
    Brush,
    /// Gaussians in a drawn loop.
    Lasso,
    /// Gaussians in a rectangle.
    Rectangle,
    /// Gaussians in a ball on the surface.
    Sphere,
    /// Gaussians of a color.
    Color,
}

impl SelectShape {
    /// Hint of what to do in the view.
    pub(crate) fn hint(self) -> &'static str {
        match self {
            Self::Click => "click on it or draw a line through it, in any view.",
            Self::Object => "click on an object or part; Alt takes the whole object.",
            Self::Brush => "drag over its Gaussians.",
            Self::Lasso => "draw a loop around its Gaussians.",
            Self::Rectangle => "drag a rectangle around its Gaussians.",
            Self::Sphere => "drag a ball over surfaces; the Gaussians inside are taken.",
            Self::Color => "click on a color; Gaussians like it are taken.",
        }
    }

    /// Returns whether the depth of the frame decides what is taken.
    pub(crate) fn is_area(self) -> bool {
        matches!(self, Self::Brush | Self::Lasso | Self::Rectangle)
    }

    /// Returns whether a click without a drag takes something.
    pub(crate) fn takes_clicks(self) -> bool {
        !matches!(self, Self::Lasso | Self::Rectangle)
    }
}
