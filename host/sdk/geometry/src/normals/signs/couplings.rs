//! What says that two nodes have equal signs, or opposite ones.

use crate::progress::{Cancelled, Progress, sort};

/// Evidence on two nodes: above 0 where both normals face what the other's does, or neither.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Coupling {
    pub(crate) a: u32,
    pub(crate) b: u32,
    /// Evidence for equal signs less that for opposite ones.
    pub(crate) net: i64,
    /// All evidence.
    pub(crate) total: i64,
}

/// Couplings of groups from those of their members: one for each pair of groups, sorted.
pub(crate) fn gathered(
    couplings: impl Iterator<Item = Coupling>,
    member: &[(u32, bool)],
    progress: Progress<'_>,
) -> Result<Vec<Coupling>, Cancelled> {
    let grouped: Vec<Coupling> = couplings
        .filter_map(|coupling| {
            let (a, flips_a) = member[coupling.a as usize];
            let (b, flips_b) = member[coupling.b as usize];
            let net = if flips_a == flips_b { coupling.net } else { -coupling.net };
            (a != b).then_some(Coupling { a: a.min(b), b: a.max(b), net, ..coupling })
        })
        .collect();
    let sorted = sort(grouped, progress)?;
    let mut sums: Vec<Coupling> = Vec::new();
    for coupling in sorted.into_iter().flatten() {
        match sums.last_mut() {
            Some(last) if (last.a, last.b) == (coupling.a, coupling.b) => {
                last.net += coupling.net;
                last.total += coupling.total;
            }
            _ => sums.push(coupling),
        }
    }
    Ok(sums)
}
