//! Batches of token rows for a text network, cut to the longest phrase where the network's input shape allows it.

use super::ModelError;
use super::network::Network;
use super::tensor::Tensor;

const INPUT: &str = "tokens";
/// Most rows in one batch.
const BATCH: usize = 32;

/// Embeds rows of tokens as unit vectors of `length` numbers. All rows are equally long and padded with zeros.
pub(super) fn embed(network: &mut Network, rows: &[Vec<i64>], length: usize) -> Vec<Result<Vec<f32>, ModelError>> {
    let free = network.free_axes(INPUT);
    let mut all = Vec::with_capacity(rows.len());
    for batch in rows.chunks(if free.first() == Some(&true) { BATCH } else { 1 }) {
        let whole = batch.first().map_or(0, Vec::len);
        let said = |row: &Vec<i64>| row.iter().rposition(|token| *token != 0).map_or(0, |last| last + 1);
        let long = batch.iter().map(said).max().filter(|_| free.get(1) == Some(&true)).unwrap_or(whole).max(1);
        let mut embedded = |rows: &[Vec<i64>]| {
            let tokens = rows.iter().flat_map(|row| row[..long].to_vec()).collect();
            let tokens = Tensor::new(&[rows.len(), long], tokens);
            network.unit_rows(vec![(INPUT, tokens.into())], "embedding", length)
        };
        match embedded(batch) {
            Ok(vectors) => all.extend(vectors.into_iter().map(Ok)),
            Err(e) if batch.len() == 1 => all.push(Err(e)),
            // One by one, so that a phrase that fails does not affect the others.
            Err(_) => all.extend(batch.iter().map(|row| embedded(std::slice::from_ref(row)).map(|mut v| v.remove(0)))),
        }
    }
    all
}

/// Embeds the valid rows and keeps the errors of the others in place. If `embed` itself fails, its error is the last.
pub(super) fn each(
    rows: Vec<Result<Vec<i64>, ModelError>>,
    embed: impl FnOnce(&[Vec<i64>]) -> Result<Vec<Result<Vec<f32>, ModelError>>, ModelError>,
) -> Vec<Result<Vec<f32>, ModelError>> {
    let (mut good, mut places) = (Vec::new(), Vec::with_capacity(rows.len()));
    for row in rows {
        places.push(row.map(|row| good.push(row)));
    }
    let mut embedded = match embed(&good) {
        Ok(vectors) => vectors.into_iter(),
        Err(e) => return vec![Err(e)],
    };
    places.into_iter().map_while(|place| place.map_or_else(|e| Some(Err(e)), |()| embedded.next())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_row_has_its_own_end_and_a_failure_of_all_ends_it() {
        let rows = || vec![Ok(vec![1]), Err(ModelError::NoKnownWord { unknown: Vec::new() }), Ok(vec![2])];
        let told = each(rows(), |rows| Ok(rows.iter().map(|row| Ok(vec![row[0] as f32])).collect()));
        assert!(matches!(&told[..], [Ok(a), Err(ModelError::NoKnownWord { .. }), Ok(b)] if a == &[1.0] && b == &[2.0]));
        let failed = || ModelError::Run { model: "text.onnx".into(), problem: "out of memory".into() };
        assert!(matches!(&each(rows(), |_| Err(failed()))[..], [Err(ModelError::Run { .. })]));
        let told = each(rows(), |_| Ok(vec![Ok(vec![1.0]), Err(failed())]));
        assert!(matches!(&told[..], [Ok(_), Err(ModelError::NoKnownWord { .. }), Err(ModelError::Run { .. })]));
    }
}
