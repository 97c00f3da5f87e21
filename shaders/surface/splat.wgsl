// Splats that a pass draws itself: what a splat function returns, and how footprints are made.
//
// A pass of splats (`Pass::splats`) calls `fn NAME(i: u32) -> splat::Splat` for each splat. Lengths are in scene units,
// places start at the scene's origin and are world-oriented, as `position` of a columns' module has them.
//
// Source: Zwicker et al. 2001, "EWA Volume Splatting"; Kerbl et al. 2023, "3D Gaussian Splatting for Real-Time Radiance
// Field Rendering", section 4; Huang et al. 2024, "2D Gaussian Splatting", sections 4.1 and 4.2; Yu et al. 2024,
// "Mip-Splatting", equation 10.
#define_import_path surfelshop::splat

#import surfelshop::view

// What a splat shows. The functions below make one whose `opacity` is 1, or less where a filter makes it fainter;
// authors multiply it by their own and fill the payload.
struct Splat {
    // Of a conic (a, b, c, 0): the exponent is -(a x^2 + 2 b x y + c y^2) / 2 of pixels x, y from the centre. Of a plane
    // the rows (x, y) and (z, w) that take places in it to pixels from the centre, times their distance.
    shape: vec4<f32>,
    // The distance along the viewing axis of a place (s, t) in the plane, in units of `view::view.unit` scene units, whose
    // products neither overflow nor vanish: dot(distance, (s, t, 1)). Of a conic (0, 0, distance).
    distance: vec3<f32>,
    // At the centre, 0 to 1; 0 draws nothing.
    opacity: f32,
    // Where the centre is seen, pixels, y downwards.
    center_px: vec2<f32>,
    // Vectors that are summed up, by how much of the splat is seen, in the pass's targets. Of a colour the fourth
    // component is 1, so that it sums up to coverage.
    payload: array<vec4<f32>, 4>,
}

// What a function of a pixel (`Pass::per_pixel`) is told: a splat that covers the pixel.
struct Pixel {
    // The number of the splat, with which the splat function was called.
    index: u32,
    // Centre of the pixel, y downwards.
    pixel: vec2<f32>,
    // Of a plane the place (s, t) in it that the pixel's ray meets, in standard deviations; (0, 0) where the splat is
    // widened on the picture. Of a conic pixels from the centre, y downwards.
    place: vec2<f32>,
    // Of the Gaussian: 0 at the centre, -1/2 at one standard deviation.
    exponent: f32,
    // Distance along the viewing axis, scene units.
    depth: f32,
    // That of the splat times the Gaussian, at most 0.99.
    opacity: f32,
    // Those that are drawn, of the splat; 0 beyond.
    payload: array<vec4<f32>, 4>,
}

// What such a function returns.
struct Fragment {
    // How much is hidden of what is behind, 0 to 1; with 0 the splat is not there.
    opacity: f32,
    // Vectors that are summed up, as those of a splat.
    payload: array<vec4<f32>, 4>,
}

// The opacity of a splat that ends at so many standard deviations, at most 3.3 of them: for functions of pixels whose
// kernels end there, which are asked of no more pixels then.
fn ending_at(deviations: f32) -> f32 {
    // A little more, so that rounding leaves none out.
    return min(1.001 * exp(0.5 * deviations * deviations) / 255.0, 1.0);
}

// The place that is seen there.
fn position_at(p: Pixel) -> vec3<f32> {
    let from_eye = view::world_from_view_direction(view::position_in_view(p.pixel, p.depth));
    return view::view.world_from_view[3].xyz + from_eye;
}

// A splat that draws nothing.
fn nothing() -> Splat {
    let zero = vec4(0.0);
    return Splat(zero, vec3(0.0), 0.0, vec2(0.0), array(zero, zero, zero, zero));
}

// A place in view space.
fn in_view(position: vec3<f32>) -> vec3<f32> {
    return view::view_from_world_direction(position - view::view.world_from_view[3].xyz);
}

// Unit direction from the eye to a place, in world axes.
fn direction_to(position: vec3<f32>) -> vec3<f32> {
    if view::view.orthographic == 1u {
        return -view::view.world_from_view[2].xyz;
    }
    // In a unit in which no scene's size can leave the range of squares.
    return normalize((position - view::view.world_from_view[3].xyz) / view::view.unit);
}

// The rotation of a unit quaternion x, y, z, w.
fn rotation(q: vec4<f32>) -> mat3x3<f32> {
    let d = 2.0 * q.xyz * q.xyz;
    let p = 2.0 * q.xyx * q.yzz;
    let w = 2.0 * q.w * q.xyz;
    return mat3x3(
        vec3(1.0 - d.y - d.z, p.x + w.z, p.z - w.y),
        vec3(p.x - w.z, 1.0 - d.x - d.z, p.y + w.x),
        vec3(p.z + w.y, p.y - w.x, 1.0 - d.x - d.y),
    );
}

// Pixels of a step of 1 across at distance 1, or, orthographic, of a scene unit; y downwards.
fn pixels_per_step() -> vec2<f32> {
    return vec2(0.5, -0.5) * view::view.size_px / view::view.half_extent;
}

// Where a place of view space is seen, pixels.
fn seen_at(p: vec3<f32>) -> vec2<f32> {
    let divisor = select(-p.z, 1.0, view::view.orthographic == 1u);
    return 0.5 * view::view.size_px - view::shift_px() + pixels_per_step() * p.xy / divisor;
}

// Beyond so many half pictures from the middle the slant of rays counts as that there, so that splats beside the picture
// do not grow without end.
//
// Source: the program of Kerbl et al. 2023.
const MAX_SLANT: f32 = 1.3;

// A Gaussian in space, by its three half axes of one standard deviation, world-oriented: its covariance projected, with a
// variance of `low_pass` square pixels added. `keeps_sum` makes it as much fainter as that makes it larger (Mip-Splatting);
// without, what is smaller than a pixel gets brighter, as in the program of 2023.
fn gaussian(position: vec3<f32>, axes: mat3x3<f32>, low_pass: f32, keeps_sum: bool) -> Splat {
    let p = in_view(position);
    let orthographic = view::view.orthographic == 1u;
    var divisor = -p.z;
    if !(divisor >= view::view.near) {
        return nothing();
    }
    var slant = clamp(p.xy / divisor, -MAX_SLANT * view::view.half_extent, MAX_SLANT * view::view.half_extent);
    if orthographic {
        divisor = 1.0;
        slant = vec2(0.0);
    }
    let step = pixels_per_step();
    var u: array<vec2<f32>, 3>;
    for (var k = 0u; k < 3u; k++) {
        let axis = view::view_from_world_direction(axes[k]);
        // Divided first: products of lengths and pixels would leave the range of f32 earlier.
        u[k] = step * ((axis.xy + slant * axis.z) / divisor);
    }
    let xx = u[0].x * u[0].x + u[1].x * u[1].x + u[2].x * u[2].x;
    let xy = u[0].x * u[0].y + u[1].x * u[1].y + u[2].x * u[2].y;
    let yy = u[0].y * u[0].y + u[1].y * u[1].y + u[2].y * u[2].y;
    // The determinant as a sum of squares (Cauchy and Binet): nothing cancels in it.
    let a = u[0].x * u[1].y - u[0].y * u[1].x;
    let b = u[1].x * u[2].y - u[1].y * u[2].x;
    let c = u[2].x * u[0].y - u[2].y * u[0].x;
    let sharp = a * a + b * b + c * c;
    let determinant = sharp + low_pass * (xx + yy + low_pass);
    var s = conic(seen_at(p), vec3(yy + low_pass, -xy, xx + low_pass) / determinant, -p.z);
    if keeps_sum {
        s.opacity = sqrt(sharp / determinant);
    }
    return s;
}

// A Gaussian in pixels, by its centre, the inverse covariance (xx, xy, yy) and its distance, scene units.
fn conic(center_px: vec2<f32>, inverse: vec3<f32>, distance: f32) -> Splat {
    var s = nothing();
    s.shape = vec4(inverse, 0.0);
    s.distance = vec3(0.0, 0.0, distance / view::view.unit);
    s.opacity = 1.0;
    s.center_px = center_px;
    return s;
}

// A Gaussian in a plane, by its two half axes of one standard deviation, world-oriented. Rays meet it exactly; on the
// picture it is at least as wide as a Gaussian of a standard deviation of 0.71 pixels.
fn planar(position: vec3<f32>, u: vec3<f32>, v: vec3<f32>) -> Splat {
    let p = in_view(position);
    let a = view::view_from_world_direction(u);
    let b = view::view_from_world_direction(v);
    let step = pixels_per_step();
    var s = nothing();
    if !(-p.z >= view::view.near) {
        return s;
    }
    s.center_px = seen_at(p);
    s.distance = -vec3(a.z, b.z, p.z) / view::view.unit;
    // From the centre instead of the picture's corner, large numbers do not cancel: the third entry of a row is 0.
    var slant = p.xy / -p.z;
    if view::view.orthographic == 1u {
        slant = vec2(0.0);
    }
    let x = step.x * (vec2(a.x, b.x) + slant.x * vec2(a.z, b.z));
    let y = step.y * (vec2(a.y, b.y) + slant.y * vec2(a.z, b.z));
    // Of parallel rays pixels are not multiplied by distances.
    s.shape = vec4(x, y) / select(view::view.unit, 1.0, view::view.orthographic == 1u);
    s.opacity = 1.0;
    return s;
}
