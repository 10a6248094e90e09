//! Which triangles of a mesh are wound against their neighbours, so that their normals point to the other side.

/// For each of these triangles, given by the places of its corners, whether it is wound against most of those that it hangs together with, by
/// area: where an edge is of two triangles, these run along it in opposite senses if they are wound alike. A sheet that has but one side, as
/// Möbius' band, is cut somewhere.
pub(super) fn against_neighbours(triangles: &[[u32; 3]], areas: &[f64]) -> Vec<bool> {
    let neighbours = neighbours(triangles);
    let mut against: Vec<Option<bool>> = vec![None; triangles.len()];
    for first in 0..triangles.len() {
        if against[first].is_some() {
            continue;
        }
        against[first] = Some(false);
        let (mut sheet, mut next) = (vec![first], 0);
        while let Some(&triangle) = sheet.get(next) {
            next += 1;
            for (other, is_alike) in neighbours[triangle].into_iter().flatten() {
                if against[other].is_none() {
                    against[other] = Some(against[triangle] != Some(!is_alike));
                    sheet.push(other);
                }
            }
        }
        let area = |is_against: bool| {
            let alike = sheet.iter().filter(|&&triangle| against[triangle] == Some(is_against));
            alike.map(|&triangle| areas[triangle]).sum::<f64>()
        };
        if area(true) > area(false) {
            sheet.iter().for_each(|&triangle| against[triangle] = against[triangle].map(|is_against| !is_against));
        }
    }
    against.into_iter().map(Option::unwrap_or_default).collect()
}

/// What each triangle shares its edges with, where that is one other, and whether both are wound alike.
fn neighbours(triangles: &[[u32; 3]]) -> Vec<[Option<(usize, bool)>; 3]> {
    let edges = triangles.iter().enumerate().flat_map(|(triangle, &[a, b, c])| {
        [[a, b], [b, c], [c, a]]
            .into_iter()
            .enumerate()
            .map(move |(edge, [from, to])| ([from.min(to), from.max(to)], triangle, edge, from < to))
    });
    let mut edges: Vec<_> = edges.collect();
    edges.sort_unstable();
    let mut neighbours = vec![[None; 3]; triangles.len()];
    for shared in edges.chunk_by(|(one, ..), (other, ..)| one == other) {
        if let &[(_, triangle, edge, is_forward), (_, other, edge_of_other, is_forward_in_other)] = shared {
            let is_alike = is_forward != is_forward_in_other;
            neighbours[triangle][edge] = Some((other, is_alike));
            neighbours[other][edge_of_other] = Some((triangle, is_alike));
        }
    }
    neighbours
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_are_against_most_of_their_sheet_and_sheets_have_nothing_to_do_with_each_other() {
        // A strip of three, the second turned; and apart from it a fan of two, of which the smaller is turned.
        let triangles = [[0, 1, 2], [1, 2, 3], [2, 3, 4], [10, 11, 12], [11, 12, 13]];
        let against = |areas: [f64; 5]| against_neighbours(&triangles, &areas);
        assert_eq!(against([1.0, 1.0, 1.0, 2.0, 1.0]), [false, true, false, false, true]);
        assert_eq!(against([1.0, 5.0, 1.0, 1.0, 2.0]), [true, false, true, true, false]);
    }

    #[test]
    fn an_edge_of_three_triangles_and_a_band_of_one_side_are_no_reason_to_turn_all() {
        assert_eq!(against_neighbours(&[[0, 1, 2], [0, 1, 3], [0, 1, 4]], &[1.0; 3]), [false; 3]);
        let band = |i: u32| {
            [
                [i, i + 5, (i + 1) % 5 + 5 * u32::from(i == 4)],
                [i + 5, (i + 1) % 5 + 5 * u32::from(i != 4), (i + 1) % 5 + 5 * u32::from(i == 4)],
            ]
        };
        let band: Vec<_> = (0..5).flat_map(band).collect();
        let against = against_neighbours(&band, &[1.0; 10]);
        assert!(against.iter().filter(|is_against| **is_against).count() <= 5, "{against:?}");
        // Seen from both of its triangles, one edge is left where the band is cut.
        let neighbours = neighbours(&band);
        let edges =
            (0..10).flat_map(|triangle| neighbours[triangle].into_iter().flatten().map(move |edge| (triangle, edge)));
        let cut = edges.filter(|&(triangle, (other, is_alike))| (against[triangle] == against[other]) != is_alike);
        assert_eq!(cut.count(), 2);
    }
}
