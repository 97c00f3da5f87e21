//! Forms that keep their digits keep them, and those that they replace do not.

use surfelshop_tests::precision::figures;

/// Invariant: forms that keep their digits keep them, and those that they replace do not
#[test]
fn robust_forms_keep_their_digits_where_textbook_forms_lose_them() {
    // In the order of the figures. Projected, interpolated between three corners, divided and stored: eight
    // steps of f32 beyond 1024.
    let far_depth = 9.8e-4;
    // WGSL's log2 may be off by 2^-21 near 1; 512 times that, times ln 2.
    let highlight = 1.7e-4;
    // WGSL lets quotients be off by 2.5 steps of f32 and roots by 2; a root that is added to, squared,
    // divided by and squared again makes 32 of them at most.
    let fresnel = 4e-6;
    // f32 offsets are rounded by 2^-24 of themselves, over neighbours a tenth as far away.
    let patch = 1e-4;
    // The sun is a texel 0.049 rad wide, taken for a direction: within light that is off by a twelfth of
    // its width's square, 2e-4, and where it sets by up to a quarter of its width, at 2.5 % of the
    // normals: 3e-4. Normals are packed to 6e-5.
    let sun = 6e-4;
    let bounds = [far_depth, highlight, fresnel, patch, sun];
    let all = figures().unwrap();
    assert_eq!(all.len(), bounds.len());
    for (figure, bound) in all.iter().zip(bounds) {
        let (before, after) = (figure.before.1, figure.after.1);
        assert!(after <= bound, "{}: {after}, at most {bound}", figure.what);
        // Otherwise the simple form would do.
        assert!(before > 50.0 * after, "{}: {before} by the form replaced", figure.what);
    }
}
