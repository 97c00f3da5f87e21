//! Pictures as such: their outputs, sizes and background.

use super::bench::{Bench, DrawRequest, front, picture, same};
use super::gaussians;
use crate::conformance::clouds;
use crate::conformance::verdict::{Failure, Judged, Said};
use surfelshop_api::View;
use surfelshop_api::graph::Output;
use surfelshop_image::Image;

const SIZE: u32 = 96;

/// Those that the host makes where a renderer does not.
const OUTPUTS: [Output; 5] =
    [Output::Color, Output::Depth, Output::Normal, Output::Albedo, Output::Ao];

fn ball() -> DrawRequest<'static> {
    DrawRequest::new(clouds::sphere(3000, 1.0).cloud(), front(SIZE))
}

pub(super) fn outputs(bench: &mut Bench<'_>) -> Judged {
    let color = bench.color(&ball())?;
    for output in &OUTPUTS[1..] {
        let shot = ball().of(&[Output::Color, output.clone()]);
        let drawn = bench.draw(&shot).map_err(|failure| failure.of(&output.name()))?;
        let what = format!("colour beside `{}`", output.name());
        same(&what, &color, &picture(&drawn, &Output::Color)?)?;
    }
    let drawn = bench.draw(&ball().of(&OUTPUTS))?;
    same("colour beside all others", &color, &picture(&drawn, &Output::Color)?)?;
    let n = OUTPUTS.len();
    Ok(Said::Measured(match bench.n_frames(&ball())? {
        1 => format!("{n} outputs, finite and whole"),
        n_frames => format!("{n} outputs, finite and whole; {n_frames} frames until they stay"),
    }))
}

pub(super) fn again(bench: &mut Bench<'_>) -> Judged {
    let shot = ball();
    let first = bench.color(&shot)?;
    same("another instance", &first, &bench.color(&shot)?)?;
    let mut instance = bench.start()?;
    for what in ["a new instance", "the same instance again"] {
        let drawn = bench.draw_by(&mut instance, &shot)?;
        same(what, &first, &picture(&drawn, &Output::Color)?)?;
    }
    Ok(Said::Measured("four pictures are one".to_owned()))
}

pub(super) fn background(bench: &mut Bench<'_>) -> Judged {
    let drawn = bench.draw(&ball().of(&[Output::Color, Output::Depth]))?;
    let color = picture(&drawn, &Output::Color)?;
    let depth = picture(&drawn, &Output::Depth)?;
    // Where Gaussians fade out there is a colour, and no depth yet.
    let (n_empty, n_filled) = match bench.fitting().has_gaussians() {
        true => gaussians::nothing(&ball().cloud, &ball().view, &color),
        false => without_depth(&depth, &color),
    };
    match n_filled {
        0 if n_empty > 0 => Ok(Said::Measured(format!("{n_empty} pixels show nothing"))),
        0 => Err(Failure::showing("depth covers the whole picture", [("depth", &depth)])),
        _ => {
            let line = format!("{n_filled} of {n_empty} pixels where nothing is are not 0");
            Err(Failure::showing(line, [("color", &color)]))
        }
    }
}

/// How many pixels have no depth, and how many of those a colour.
fn without_depth(depth: &Image, color: &Image) -> (usize, usize) {
    let n = (depth.components.max(1) as usize, color.components.max(1) as usize);
    let pairs = depth.data.chunks_exact(n.0).zip(color.data.chunks_exact(n.1));
    let empty: Vec<&[f32]> =
        pairs.filter(|(depth, _)| depth[0] == 0.0).map(|(_, color)| color).collect();
    let n_filled = empty.iter().filter(|color| color.iter().any(|value| *value != 0.0)).count();
    (empty.len(), n_filled)
}

pub(super) fn viewport(bench: &mut Bench<'_>) -> Judged {
    let sizes = [[1, 1], [1, 61], [61, 1], [3, 2], [2048, 1024]];
    for size_px in sizes {
        let view = View { size_px, ..front(SIZE) };
        let shot = DrawRequest { view, ..ball() };
        let what = format!("{} x {}", size_px[0], size_px[1]);
        let color = bench.color(&shot).map_err(|failure| failure.of(&what))?;
        if color.data.chunks_exact(4).all(|pixel| pixel[3] == 0.0) {
            return Err(Failure::new(format!("{what}: the picture is empty")));
        }
    }
    Ok(Said::Measured(format!("{} sizes", sizes.len())))
}

pub(super) fn resize(bench: &mut Bench<'_>) -> Judged {
    let shot = |size_px| DrawRequest { view: View { size_px, ..front(SIZE) }, ..ball() };
    let [here, there] = [shot([SIZE, SIZE]), shot([131, 77])];
    let expected = [bench.color(&here)?, bench.color(&there)?];
    let mut instance = bench.start()?;
    let steps = [
        (&here, &expected[0], "the first size"),
        (&there, &expected[1], "another size"),
        (&here, &expected[0], "the first size again"),
    ];
    for (shot, expected, what) in steps {
        let drawn = bench.draw_by(&mut instance, shot).map_err(|failure| failure.of(what))?;
        same(what, expected, &picture(&drawn, &Output::Color)?)?;
    }
    Ok(Said::Measured("three sizes of one instance".to_owned()))
}
