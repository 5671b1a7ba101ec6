//! Small symmetric positive definite systems, by Cholesky's factorization.

/// The lower triangle `l` with `l lᵀ = a`; `None` unless `a` is positive definite.
fn factor<const N: usize>(a: &[[f64; N]; N]) -> Option<[[f64; N]; N]> {
    let mut l = [[0.0; N]; N];
    for i in 0..N {
        for j in 0..=i {
            let rest = a[i][j] - (0..j).map(|k| l[i][k] * l[j][k]).sum::<f64>();
            l[i][j] = match i == j {
                true if rest.is_finite() && rest > 0.0 => rest.sqrt(),
                true => return None,
                false => rest / l[j][j],
            };
        }
    }
    Some(l)
}

/// Solves `a x = b`; `None` unless `a` is positive definite.
pub(crate) fn solve<const N: usize>(a: &[[f64; N]; N], b: &[f64; N]) -> Option<[f64; N]> {
    let l = factor(a)?;
    let mut x = *b;
    for i in 0..N {
        x[i] = (x[i] - (0..i).map(|k| l[i][k] * x[k]).sum::<f64>()) / l[i][i];
    }
    for i in (0..N).rev() {
        x[i] = (x[i] - (i + 1..N).map(|k| l[k][i] * x[k]).sum::<f64>()) / l[i][i];
    }
    x.iter().all(|v| v.is_finite()).then_some(x)
}

/// The inverse of `a`; `None` unless it is positive definite.
pub(crate) fn inverse<const N: usize>(a: &[[f64; N]; N]) -> Option<[[f64; N]; N]> {
    let mut out = [[0.0; N]; N];
    for (i, row) in out.iter_mut().enumerate() {
        *row = solve(a, &std::array::from_fn(|k| if k == i { 1.0 } else { 0.0 }))?;
    }
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_system_is_solved_and_an_indefinite_one_refused() {
        let a = [[4.0, 2.0, 0.6], [2.0, 5.0, 1.0], [0.6, 1.0, 3.0]];
        let x = solve(&a, &[1.0, -2.0, 3.0]).expect("positive definite");
        for (row, want) in a.iter().zip([1.0, -2.0, 3.0]) {
            let found: f64 = row.iter().zip(x).map(|(a, x)| a * x).sum();
            assert!((found - want).abs() < 1e-12, "{found} {want}");
        }
        let inverse = inverse(&a).expect("positive definite");
        for i in 0..3 {
            for j in 0..3 {
                let one: f64 = (0..3).map(|k| a[i][k] * inverse[k][j]).sum();
                assert!((one - f64::from(u8::from(i == j))).abs() < 1e-12);
            }
        }
        assert_eq!(solve(&[[1.0, 2.0], [2.0, 1.0]], &[1.0, 1.0]), None);
        assert_eq!(solve(&[[0.0]], &[1.0]), None);
    }
}
