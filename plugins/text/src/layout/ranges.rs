//! What columns without names hold, guessed by their number and their values.

use super::facts::Numbers;
use super::names::Target;
use surfelshop_api::columns::{COLOR, NORMAL, POSITION};
use surfelshop_api::format::INTENSITY;

/// What columns hold: x, y and z first; then directions of length 1 and colours wherever three columns look like
/// them; a column before the colours is intensity, as in PTS files, and so is a fourth of four. What stays
/// unknown is called by its place, `column_5`.
pub(crate) fn targets(numbers: &Numbers, numeric: &[bool]) -> Vec<Option<Target>> {
    let n = numeric.len();
    let mut targets: Vec<Option<Target>> = vec![None; n];
    let places: Vec<usize> = (0..n).filter(|&i| numeric[i]).collect();
    for (component, &place) in places.iter().take(3).enumerate() {
        targets[place] = Some(Target::new(POSITION, component));
    }
    let Some(&last) = places.get(2) else { return targets };
    let first = last + 1;
    let is_free = |targets: &[Option<Target>], start: usize| {
        start + 3 <= n && (start..start + 3).all(|i| numeric[i] && targets[i].is_none())
    };
    let directions = (first..n).find(|&i| is_free(&targets, i) && numbers.are_directions(i));
    name_three(&mut targets, directions, NORMAL);
    // Colours of 16 bits are rare: they are taken for such where there are none of 8.
    let colors = [255.0, 65_535.0].map(|most| {
        let could_be = |&i: &usize| is_free(&targets, i) && numbers.are_colors(i, most);
        (first..n).filter(could_be).collect::<Vec<usize>>()
    });
    let colors = colors.into_iter().find(|places| !places.is_empty()).unwrap_or_default();
    name_three(&mut targets, colors_start(&colors, numbers), COLOR);
    name_alpha(&mut targets, numbers);
    let red = targets.iter().position(|target| is(target.as_ref(), COLOR, 0));
    let before_red = red.and_then(|red| red.checked_sub(1));
    let alone = Some(first).filter(|_| n == first + 1);
    let intensity = before_red.or(alone).filter(|&i| numeric[i] && targets[i].is_none());
    if let Some(place) = intensity {
        targets[place] = Some(Target::new(INTENSITY, 0));
    }
    for (i, target) in targets.iter_mut().enumerate() {
        if target.is_none() && numeric[i] {
            *target = Some(Target::new(&format!("column_{}", i + 1), 0));
        }
    }
    targets
}

fn is(target: Option<&Target>, column: &str, component: usize) -> bool {
    target.is_some_and(|target| target.column == column && target.component == component)
}

fn name_three(targets: &mut [Option<Target>], start: Option<usize>, column: &str) {
    let Some(start) = start else { return };
    for (component, target) in targets[start..start + 3].iter_mut().enumerate() {
        *target = Some(Target::new(column, component));
    }
}

/// Which of several places colours begin at: where four columns in a row could be colours, the first is intensity,
/// but where the last is the same everywhere and the first is not, that is opacity.
fn colors_start(colors: &[usize], numbers: &Numbers) -> Option<usize> {
    let is_constant = |i: usize| numbers.facts.get(i).is_some_and(|f| f.min == f.max);
    match colors {
        [start, next, ..] if *next == start + 1 => {
            let last = start + 3;
            let opacity = is_constant(last) && !is_constant(*start) && is_opaque(numbers, last);
            Some(if opacity { *start } else { *next })
        }
        _ => colors.first().copied(),
    }
}

fn is_opaque(numbers: &Numbers, place: usize) -> bool {
    numbers.facts.get(place).is_some_and(|facts| [1.0, 255.0, 65_535.0].contains(&facts.max))
}

/// A column behind colours that says "opaque" everywhere is their fourth component.
fn name_alpha(targets: &mut [Option<Target>], numbers: &Numbers) {
    let Some(blue) = targets.iter().position(|t| is(t.as_ref(), COLOR, 2)) else { return };
    let (alpha, colors) = (blue + 1, blue.saturating_sub(2)..blue + 1);
    let largest = |i: usize| numbers.facts.get(i).map_or(f64::NAN, |facts| facts.max);
    let is_constant = numbers.facts.get(alpha).is_some_and(|facts| facts.min == facts.max);
    let fits = colors.map(largest).all(|max| max <= largest(alpha));
    if is_constant && fits && is_opaque(numbers, alpha) && targets[alpha].is_none() {
        targets[alpha] = Some(Target::new(COLOR, 3));
    }
}
