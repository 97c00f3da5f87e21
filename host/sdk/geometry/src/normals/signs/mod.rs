//! Signs of nodes that fulfil most of what couples them.

mod couplings;
mod sets;

use crate::progress::{Cancelled, Progress, part, report};
pub(crate) use couplings::{Coupling, agreement, gathered, merged, summed};
pub(crate) use sets::SignedSets;

/// Nodes that join into one in a round, at most: in small steps evidence gathers before it counts.
const JOINED: u32 = 6;

/// Share of a node's best evidence that a pair needs to join in a round.
const NEARLY_BEST: f64 = 0.5;

/// Rounds of joining. Each makes at least a third fewer nodes, so that it ends long before.
const ROUNDS: usize = 40;

/// Rounds in which single nodes turn, at each size of groups.
const SWEEPS: usize = 8;

/// Nodes before they join.
struct Level {
    nodes: usize,
    couplings: Vec<Coupling>,
    /// For each node the group it joins, and whether its sign is the opposite of the group's.
    member: Vec<(u32, bool)>,
}

/// Couplings by node.
struct Around {
    start: Vec<u32>,
    others: Vec<(u32, i64)>,
}

impl Around {
    fn of(count: usize, couplings: &[Coupling]) -> Self {
        let mut start = vec![0u32; count + 1];
        for coupling in couplings {
            start[coupling.a as usize + 1] += 1;
            start[coupling.b as usize + 1] += 1;
        }
        for node in 0..count {
            start[node + 1] += start[node];
        }
        let mut next = start.clone();
        let mut others = vec![(0, 0); 2 * couplings.len()];
        for coupling in couplings {
            for (node, other) in [(coupling.a, coupling.b), (coupling.b, coupling.a)] {
                others[next[node as usize] as usize] = (other, coupling.net);
                next[node as usize] += 1;
            }
        }
        Self { start, others }
    }

    /// What the others say of a node's sign.
    fn field(&self, node: usize, signs: &[bool]) -> i64 {
        let range = self.start[node] as usize..self.start[node + 1] as usize;
        self.others[range].iter().map(|&(o, net)| if signs[o as usize] { net } else { -net }).sum()
    }
}

/// How sure the sign of a pair is: evidence that contradicts itself counts less.
fn certainty(coupling: &Coupling) -> f64 {
    let net = coupling.net as f64;
    net * net / (coupling.total as f64).max(1.0)
}

/// Joins pairs that are sure and among the surest of one of their nodes.
fn joined(count: usize, couplings: &[Coupling]) -> (Vec<(u32, bool)>, usize) {
    let mut best = vec![0.0f64; count];
    for coupling in couplings {
        for node in [coupling.a, coupling.b] {
            best[node as usize] = best[node as usize].max(certainty(coupling));
        }
    }
    let enough = |c: &&Coupling| {
        let least = best[c.a as usize].min(best[c.b as usize]);
        c.net != 0 && certainty(c) >= NEARLY_BEST * least
    };
    let mut order: Vec<&Coupling> = couplings.iter().filter(enough).collect();
    order.sort_unstable_by(|x, y| {
        certainty(y).total_cmp(&certainty(x)).then((x.a, x.b).cmp(&(y.a, y.b)))
    });
    let mut sets = SignedSets::new(count);
    for coupling in order {
        sets.join(coupling.a, coupling.b, coupling.net < 0, JOINED);
    }
    sets.numbered()
}

/// Turns nodes that most of what couples them is against.
fn refine(count: usize, couplings: &[Coupling], signs: &mut [bool]) {
    let around = Around::of(count, couplings);
    for _ in 0..SWEEPS {
        let mut turned = false;
        for node in 0..count {
            let field = around.field(node, signs);
            if field != 0 && (field > 0) != signs[node] {
                signs[node] = !signs[node];
                turned = true;
            }
        }
        if !turned {
            break;
        }
    }
}

/// Signs of nodes, true for equal ones; all of them may as well be the other way round.
///
/// Groups of nodes join into larger ones by the surest evidence between them until no evidence is
/// left, and on the way back those turn that most evidence is against: the largest groups first.
pub(crate) fn solve(
    count: usize,
    couplings: Vec<Coupling>,
    progress: Progress<'_>,
) -> Result<Vec<bool>, Cancelled> {
    let mut levels: Vec<Level> = Vec::new();
    let (mut nodes, mut current) = (count, couplings);
    for round in 0..ROUNDS {
        // Later rounds are shorter.
        let share = |round: usize| 1.0 - 0.7f64.powi(round as i32);
        let step = part(progress, share(round)..share(round + 1));
        report(&step, 0.0)?;
        let (member, fewer) = joined(nodes, &current);
        if fewer == nodes {
            break;
        }
        let next = gathered(current.iter().copied(), &member, &step)?;
        levels.push(Level { nodes, couplings: current, member });
        (nodes, current) = (fewer, next);
    }
    let mut signs = vec![true; nodes];
    refine(nodes, &current, &mut signs);
    for Level { nodes, couplings, member } in levels.iter().rev() {
        signs = member.iter().map(|&(group, opposite)| signs[group as usize] != opposite).collect();
        refine(*nodes, couplings, &mut signs);
    }
    report(progress, 1.0)?;
    Ok(signs)
}
