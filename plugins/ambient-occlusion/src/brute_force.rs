//! Every pair of surfels: eq. 10 and 11 of the thesis as they stand, for comparison.

use crate::form_factor::{Emitter, Reach, Receivers, Sums, single};
use crate::lanes::on_best;
use crate::surfels::Surfels;
use std::ops::Range;

/// Emitters whose sum is added up before it joins the total: short sums keep f32's rounding below
/// a millionth of the total.
const BLOCK: usize = 1024;

/// What all emitters cover of the sky of at most sixteen receivers.
pub(crate) fn gather(
    surfels: &Surfels,
    emitters: &[Emitter],
    places: Range<usize>,
    reach: Reach,
) -> Sums {
    on_best(
        #[inline(always)]
        || {
            let receivers = Receivers::of(surfels, places);
            let mut total = Sums::ZERO;
            for block in emitters.chunks(BLOCK) {
                let mut sums = Sums::ZERO;
                for emitter in block {
                    sums.add(single(&receivers, emitter, reach));
                }
                total.add(sums);
            }
            total
        },
    )
}
