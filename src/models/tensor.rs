//! Input and output arrays of networks.

/// Array with a shape, row-major.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tensor<T = f32> {
    /// Length of each axis.
    pub shape: Vec<usize>,
    /// Values; as many as the product of the axes.
    pub values: Vec<T>,
}

impl<T: Clone> Tensor<T> {
    /// Builds an array; its values have to fill its shape.
    pub fn new(shape: &[usize], values: Vec<T>) -> Self {
        debug_assert_eq!(shape.iter().product::<usize>(), values.len(), "{shape:?}");
        Self { shape: shape.to_vec(), values }
    }

    /// Builds an array with the same value everywhere.
    pub fn filled(shape: &[usize], value: T) -> Self {
        Self { shape: shape.to_vec(), values: vec![value; shape.iter().product()] }
    }

    /// Concatenates arrays of one shape along their first axis.
    pub fn joined<'a>(parts: impl IntoIterator<Item = &'a Self>) -> Self
    where
        T: 'a,
    {
        let mut joined: Option<Self> = None;
        for part in parts {
            match &mut joined {
                None => joined = Some(part.clone()),
                Some(all) => {
                    all.shape[0] += part.shape[0];
                    all.values.extend_from_slice(&part.values);
                }
            }
        }
        joined.unwrap_or_else(|| Self { shape: vec![0], values: Vec::new() })
    }

    /// Returns the `i`-th slice along the first axis, which stays, with length 1.
    pub fn row(&self, i: usize) -> Self {
        let n = self.values.len() / self.shape[0].max(1);
        let mut shape = self.shape.clone();
        shape[0] = 1;
        Self { shape, values: self.values[i * n..(i + 1) * n].to_vec() }
    }
}

pub(crate) enum NetworkInput {
    Floats(Tensor<f32>),
    Ints(Tensor<i64>),
}

impl NetworkInput {
    pub(super) fn shape(&self) -> &[usize] {
        match self {
            Self::Floats(a) => &a.shape,
            Self::Ints(a) => &a.shape,
        }
    }
}

impl From<Tensor<f32>> for NetworkInput {
    fn from(array: Tensor<f32>) -> Self {
        Self::Floats(array)
    }
}

impl From<&Tensor<f32>> for NetworkInput {
    fn from(array: &Tensor<f32>) -> Self {
        Self::Floats(array.clone())
    }
}

impl From<Tensor<i64>> for NetworkInput {
    fn from(array: Tensor<i64>) -> Self {
        Self::Ints(array)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrays_join_and_part_along_their_first_axis() {
        let (a, b) = (Tensor::new(&[1, 2], vec![1.0, 2.0]), Tensor::new(&[2, 2], vec![3.0, 4.0, 5.0, 6.0]));
        let both = Tensor::joined([&a, &b]);
        assert_eq!((both.shape.as_slice(), both.row(2)), ([3, 2].as_slice(), Tensor::new(&[1, 2], vec![5.0, 6.0])));
        assert_eq!(Tensor::<f32>::joined([]).values.len(), 0);
    }
}
