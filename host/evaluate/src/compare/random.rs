//! Whether pictures and their reference are made with random numbers of their own.

use super::candidate::Candidate;
use anyhow::bail;
use surfelshop_api::UnitKind;
use surfelshop_api::params::{ParamDecl, Value, Values};
use surfelshop_runtime::plugins::UnitRef;

/// The parameter that says where random numbers begin.
pub const SEED: &str = "seed";

/// The seed that a unit works with; `None` where it declares none.
pub fn seed(declared: &[ParamDecl], values: &Values) -> Option<Value> {
    let declared = declared.iter().find(|declared| declared.id == SEED)?;
    Some(declared.sanitise(values.get(SEED)))
}

/// Refuses tracers that are measured against themselves with the same random numbers: samples that
/// both have in common hide the error, and the reference's variance is none of their difference.
pub(super) fn check(candidates: &[Candidate], truth: usize) -> anyhow::Result<()> {
    let of = |candidate: &Candidate| {
        let ready = candidate.ready.as_ref().ok()?;
        seed(&ready.unit.description.params, &candidate.values)
    };
    let Some(judge) = candidates.get(truth) else { return Ok(()) };
    for (i, one) in candidates.iter().enumerate() {
        let shares = i != truth && is_same(&one.reference, &judge.reference);
        if shares && of(one).is_some() && of(one) == of(judge) {
            let (name, other) = (&one.name, &judge.name);
            bail!(
                "`{name}` and the reference `{other}` have the same random numbers, which would hide \
                 their errors; give one another seed, as --set {name}:{SEED}=1"
            );
        }
    }
    Ok(())
}

/// Whether two are one tracer.
pub fn is_same(one: &UnitRef, other: &UnitRef) -> bool {
    one.kind == UnitKind::Tracer && one == other
}
