//! What pictures do not depend on.

use super::*;
use glam::Mat4;
use half::f16;
use std::array::from_fn;
use std::sync::Arc;

/// Surfels on a sphere of radius 1 around (0, 0, -3).
fn sphere(n: usize) -> Columns {
    sphere_of(n, None)
}

fn sphere_of(n: usize, round: Option<&[u8]>) -> Columns {
    let golden = std::f32::consts::PI * (3.0 - 5f32.sqrt());
    let normals: Vec<f32> = (0..n)
        .flat_map(|i| {
            let z = 1.0 - (2 * i + 1) as f32 / n as f32;
            let (ring, angle) = ((1.0 - z * z).sqrt(), golden * i as f32);
            [ring * angle.cos(), ring * angle.sin(), z]
        })
        .collect();
    let away = |(i, x): (usize, &f32)| if i % 3 == 2 { x - 3.0 } else { *x };
    let positions: Vec<f32> = normals.iter().enumerate().map(away).collect();
    let radii: Vec<f32> =
        (0..n).map(|i| 4.0 / (n as f32).sqrt() * (1.0 + (i % 7) as f32)).collect();
    let ao: Vec<f32> = (0..n).map(|i| (i % 11) as f32 / 10.0).collect();
    let materials: Vec<u32> = (0..n).map(|i| (i / 500) as u32).collect();
    let geometry =
        Geometry { round, positions: &positions, normals: &normals, radii: &radii, tangents: None };
    let sources = Sources { geometry, ao: Some(&ao), materials: Some(&materials), all_read: true };
    let order: Arc<Vec<u32>> = Arc::new((0..n as u32).collect());
    let halves = order.iter().map(|&i| [0, 1, 2, 3].map(|k| f16::from_f32((i * k % 255) as f32)));
    let albedo = Albedo::Halves(halves.collect());
    made(&sources, order, albedo, Merging::Once)
}

fn made(sources: &Sources<'_>, order: Arc<Vec<u32>>, albedo: Albedo, merging: Merging) -> Columns {
    Columns::new(sources, order, albedo, Splats::default(), merging, &linear(), &|_| ())
}

fn linear() -> [f32; 256] {
    from_fn(|code| (code as f32 / 255.0).powi(2))
}

fn view(orthographic: bool, detail_px: f32) -> View {
    View {
        // No multiple of a tile, nor of four pixels.
        size_px: [203, 101],
        half_extent: if orthographic { [2.2, 1.1] } else { [0.8, 0.4] },
        shift_px: [0.0; 2],
        near: 1e-3,
        orthographic,
        world_from_view: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        two_sided: true,
        back_albedo: None,
        low_pass: 1.0,
        tolerance: 1.0,
        tangent_scale: 1.0,
        unit: 1.0,
        detail_px,
    }
}

/// A cloud where it is, and first.
fn placed(columns: &Columns) -> Cloud<'_> {
    let round_reach = f32::INFINITY;
    Cloud {
        columns,
        geometry: None,
        view_from_cloud: Mat4::IDENTITY,
        first: 1,
        object: 0,
        round_reach,
    }
}

/// All that is made of a picture.
type Bits = (Vec<[u32; 2]>, Vec<[u32; 4]>, Vec<u32>, Vec<u32>);

fn drawn(level: Level, columns: [&Columns; 2], view: &View, mode: Mode) -> Bits {
    let moved = Mat4::from_translation(glam::Vec3::new(0.4, 0.1, 0.2));
    let clouds = [
        placed(columns[0]),
        Cloud {
            columns: columns[1],
            geometry: None,
            view_from_cloud: moved,
            first: 1 + columns[0].len() as u32,
            object: 1,
            round_reach: f32::INFINITY,
        },
    ];
    let parts = Parts { mode, winners: true, material: true, object: true };
    let mut picture = Picture::default();
    draw_with(level, &clouds, view, parts, &linear(), &mut picture);
    (picture.winners, picture.packed, picture.material, picture.object)
}

#[test]
fn pictures_do_not_depend_on_the_processor_s_instructions_nor_on_threads() {
    let (one, other) = (sphere(4000), sphere(700));
    let threads = |n: usize| rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
    let (single, several) = (threads(1), threads(3));
    for (orthographic, detail_px) in [(false, 0.0), (false, 9.0), (true, 0.0)] {
        let view = view(orthographic, detail_px);
        for mode in [Mode::Blended, Mode::Nearest] {
            let bits = |level| drawn(level, [&one, &other], &view, mode);
            let best = single.install(|| bits(Level::new()));
            let covered = best.0.iter().filter(|winner| winner[0] != 0).count();
            assert!(covered > 3000, "{covered} pixels");
            assert!(best == single.install(|| bits(Level::baseline())), "other instructions");
            assert!(best == several.install(|| bits(Level::new())), "three threads");
        }
    }
}

#[test]
fn what_is_drawn_into_used_memory_is_what_is_drawn_into_new() {
    let (large, small) = (sphere(2000), sphere(100));
    let parts = Parts { mode: Mode::Blended, winners: true, material: false, object: false };
    let mut used = Picture::default();
    let draw_into = |columns: &Columns, orthographic: bool, picture: &mut Picture| {
        let clouds = [placed(columns)];
        draw(&clouds, &view(orthographic, 0.0), parts, &linear(), picture);
    };
    draw_into(&large, true, &mut used);
    draw_into(&small, false, &mut used);
    let mut fresh = Picture::default();
    draw_into(&small, false, &mut fresh);
    assert!(used.packed == fresh.packed && used.winners == fresh.winners);
    assert_eq!(used.drawn, fresh.drawn);
}

#[test]
fn winners_name_surfels_of_the_cloud_also_where_they_are_merged() {
    let columns = sphere(4000);
    let view = view(false, 30.0);
    let clouds = [placed(&columns)];
    let parts = Parts { mode: Mode::None, winners: true, material: true, object: false };
    let mut picture = Picture::default();
    draw(&clouds, &view, parts, &linear(), &mut picture);
    assert!(picture.drawn.surfels < 3900, "{:?}", picture.drawn);
    for (winner, material) in picture.winners.iter().zip(&picture.material) {
        let number = winner[0] & !(1 << 31);
        assert!(number <= 4000);
        if number > 0 {
            assert_eq!(*material, (number - 1) / 500, "materials are those of the surfels");
        }
    }
}

/// Discs on the faces of a box from -1 to 1, turned, around (0, 0, -5), and a sheet seen from behind beside it.
fn solid_and_sheet(only_sheet: bool) -> Columns {
    let turned = glam::Mat3::from_euler(glam::EulerRot::XYZ, 0.5, 0.6, 0.2);
    let (mut positions, mut normals) = (Vec::new(), Vec::new());
    let n = 9;
    let at = |i: usize| (i as f32 + 0.5) / n as f32 * 2.0 - 1.0;
    for axis in (0..3).filter(|_| !only_sheet) {
        for side in [-1.0, 1.0] {
            for (i, j) in (0..n * n).map(|k| (k % n, k / n)) {
                let mut place = [0.0; 3];
                (place[axis], place[(axis + 1) % 3], place[(axis + 2) % 3]) = (side, at(i), at(j));
                let mut normal = [0.0; 3];
                normal[axis] = side;
                let place = turned * glam::Vec3::from(place) - glam::Vec3::new(0.0, 0.0, 5.0);
                positions.extend(place.to_array());
                normals.extend((turned * glam::Vec3::from(normal)).to_array());
            }
        }
    }
    for (i, j) in (0..n * n).map(|k| (k % n, k / n)) {
        positions.extend([2.4 + 0.5 * at(i), at(j), -5.0]);
        normals.extend([0.0, 0.0, -1.0]);
    }
    let count = positions.len() / 3;
    let geometry = Geometry {
        round: None,
        positions: &positions,
        normals: &normals,
        radii: &vec![0.2; count],
        tangents: None,
    };
    let sources = Sources { geometry, ao: None, materials: None, all_read: true };
    let order = Arc::new((0..count as u32).collect());
    let albedo = Albedo::Same([0.5; 3]);
    made(&sources, order, albedo, Merging::No)
}

/// Invariant: what sticks out past a rim looks as the rim does, nothing vanishes, and thin sheets keep their backs
#[test]
fn rims_look_as_their_fronts_and_sheets_keep_their_backs() {
    for orthographic in [false, true] {
        let mut view = view(orthographic, 0.0);
        view.half_extent = if orthographic { [4.0, 2.0] } else { [0.8, 0.4] };
        let drawn = |columns: &Columns, two_sided: bool| {
            let view = View { two_sided, ..view };
            let clouds = [placed(columns)];
            let parts =
                Parts { mode: Mode::Nearest, winners: true, material: false, object: false };
            let mut picture = Picture::default();
            draw(&clouds, &view, parts, &linear(), &mut picture);
            picture
        };
        let both = drawn(&solid_and_sheet(false), true);
        let fronts = drawn(&solid_and_sheet(false), false);
        let normals_of_fronts: Vec<u32> =
            fronts.packed.iter().filter(|words| words[0] != 0).map(|words| words[1]).collect();
        let sheet = drawn(&solid_and_sheet(true), true);
        let is_back = |winner: &[u32; 2]| winner[0] >> 31 == 1;
        let (mut rims, mut of_sheet) = (0, 0);
        for (i, (words, winner)) in both.packed.iter().zip(&both.winners).enumerate() {
            assert_eq!(words[0], winner[1], "distances stay");
            assert_eq!(words[0] != 0, winner[0] != 0, "nothing vanishes");
            if is_back(winner) && sheet.winners[i][0] != 0 {
                assert_eq!(words[1], sheet.packed[i][1], "sheets have backs");
                of_sheet += 1;
            } else if is_back(winner) {
                assert!(normals_of_fronts.contains(&words[1]), "pixel {i} is lit from behind");
                rims += 1;
            }
        }
        assert!(rims > 20 && of_sheet > 500, "{rims} {of_sheet}");
    }
}

/// Round splats are at most as large as the bound says, merged ones as large as what they stand for.
///
/// Invariant: near round splats are bounded, and merged ones leave no holes
#[test]
fn near_round_splats_are_bounded_and_merged_ones_cover_what_they_stand_for() {
    let columns = sphere_of(60_000, Some(&[1; 60_000]));
    // Their spacing is 0.9 pixels where they are nearest, their radii are up to 7 pixels, and the bound is 2.5.
    let covered = |round_reach: f32, view: &View| {
        let clouds = [Cloud { round_reach, ..placed(&columns) }];
        let parts = Parts { mode: Mode::None, winners: true, material: false, object: false };
        let mut picture = Picture::default();
        draw(&clouds, view, parts, &linear(), &mut picture);
        let covered: Vec<bool> = picture.winners.iter().map(|winner| winner[0] != 0).collect();
        (covered, picture.drawn.surfels)
    };
    let count = |(covered, _): &(Vec<bool>, usize)| covered.iter().filter(|&&is| is).count();
    let fine = covered(0.02, &view(false, 0.0));
    let free = covered(f32::INFINITY, &view(false, 0.0));
    assert!(count(&free) > count(&fine) + 500, "{} {}", count(&free), count(&fine));
    let coarse = covered(0.02, &view(false, 20.0));
    assert!(coarse.1 + 5000 < fine.1, "{} of {}", coarse.1, fine.1);
    let holes = fine.0.iter().zip(&coarse.0).filter(|(fine, coarse)| **fine && !**coarse).count();
    assert_eq!(holes, 0);
    // Where the bound leaves nothing of single ones, merged ones are what they were.
    assert_eq!(count(&covered(0.0, &view(false, 0.0))), 0);
    let merged = count(&covered(0.0, &view(false, 20.0)));
    assert!(merged > 1000, "{merged}");
    // The factor on radii counts for what is bounded, too, and a parallel projection knows no near.
    let larger = View { tangent_scale: 2.0, ..view(false, 0.0) };
    assert!(count(&covered(0.02, &larger)) > count(&fine) + 100);
    let parallel = view(true, 0.0);
    assert!(covered(0.02, &parallel).0 == covered(f32::INFINITY, &parallel).0);
}

/// Surfels of a square in the order of a curve.
struct Square {
    positions: Vec<f32>,
    normals: Vec<f32>,
    radii: Vec<f32>,
    round: Vec<u8>,
}

impl Square {
    fn new(n: usize, depth: f32, n_round: usize) -> Self {
        // Every other bit of the number.
        let along = |i: usize| (0..12).map(|bit| (i >> (2 * bit) & 1) << bit).sum::<usize>() as f32;
        Self {
            positions: (0..n).flat_map(|i| [along(i), along(i >> 1), depth]).collect(),
            normals: [0.0, 0.0, 1.0].repeat(n),
            radii: vec![0.8; n],
            round: (0..n).map(|i| u8::from(i < n_round)).collect(),
        }
    }

    fn geometry(&self) -> Geometry<'_> {
        Geometry {
            round: Some(&self.round),
            positions: &self.positions,
            normals: &self.normals,
            radii: &self.radii,
            tangents: None,
        }
    }

    /// With linear albedos and accessibilities.
    fn painted(&self, merging: Merging, paint: &dyn Fn(usize) -> ([f32; 3], f32)) -> Columns {
        let n = self.radii.len();
        let ao: Vec<f32> = (0..n).map(|i| paint(i).1).collect();
        let geometry = self.geometry();
        let sources = Sources { geometry, ao: Some(&ao), materials: None, all_read: false };
        let albedo = Albedo::Halves((0..n).map(|i| halves(paint(i).0)).collect());
        let order = Arc::new((0..n as u32).collect());
        made(&sources, order, albedo, merging)
    }
}

fn halves([r, g, b]: [f32; 3]) -> [f16; 4] {
    [r, g, b, 1.0].map(f16::from_f32)
}

/// Invariant: surfels that are painted, and merged ones with them, are those that were put in order with these values
///
/// Half a second: several parts of the tree, and levels above.
#[test]
fn painting_is_putting_in_order_anew() {
    const N: usize = 400_000;
    let before = |i: usize| ([0.2, (i % 13) as f32 / 13.0, 0.5], (i % 11) as f32 / 10.0);
    let is_painted = |i: usize| (70_000..70_400).contains(&i) || i.is_multiple_of(190_001);
    let after =
        |i: usize| if is_painted(i) { ([1.0, 0.25, (i % 5) as f32], 0.3) } else { before(i) };
    let places: Vec<u32> = (0..N as u32).filter(|&i| is_painted(i as usize)).collect();
    let paint = |albedo: &dyn Fn(usize) -> [f32; 3]| Paint {
        albedo: Albedo::Halves(places.iter().map(|&i| halves(albedo(i as usize))).collect()),
        ao: Some(places.iter().map(|&i| after(i as usize).1).collect()),
        places: places.clone(),
    };
    let square = Square::new(N, -5.0, 0);
    let bytes = |columns: &Columns| {
        columns.make_all_parts(&square.geometry());
        let parts = [Part::Position, Part::Normal, Part::Radius, Part::Color, Part::Ao];
        let mut all = Vec::new();
        for place in 0..columns.n_places() {
            parts.into_iter().for_each(|part| columns.put(part, place, &mut all));
        }
        all
    };
    let repaint = |columns: &mut Columns, albedo: &dyn Fn(usize) -> [f32; 3]| {
        columns.repaint(&paint(albedo), &square.geometry(), &linear())
    };
    for merging in [Merging::No, Merging::Repaintable] {
        let made = bytes(&square.painted(merging, &after));
        assert!(made != bytes(&square.painted(merging, &before)), "{merging:?}");
        for is_read_before in [true, false] {
            let mut columns = square.painted(merging, &before);
            if is_read_before {
                columns.make_all_parts(&square.geometry());
            }
            assert!(repaint(&mut columns, &|i| after(i).0), "{merging:?}");
            assert!(bytes(&columns) == made, "{merging:?}");
        }
    }
    // Where nothing is kept, or other surfels would be merged.
    assert!(!repaint(&mut square.painted(Merging::Once, &before), &|i| after(i).0));
    assert!(!repaint(&mut square.painted(Merging::Repaintable, &before), &|_| [f32::NAN; 3]));
}

/// Invariant: parts are put in order once a view draws them, and pictures are those of columns that are whole
///
/// A second: 640 parts, the last of which is not full, with fronts and backs.
#[test]
fn parts_are_made_when_they_are_drawn() {
    const N: u32 = 655_000;
    const PART_GROUPS: usize = level_of_detail::PART / GROUP;
    let square = Square::new(N as usize, -900.0, 1 << 16);
    let geometry = square.geometry();
    // Blocks stay blocks, and come in another order than in the file.
    let exchanged = |i: u32| Some(i ^ 0x4005).filter(|&other| other < N).unwrap_or(i);
    let order: Arc<Vec<u32>> = Arc::new((0..N).map(exchanged).collect());
    let columns = |all_read: bool| {
        let sources = Sources { geometry, ao: None, materials: None, all_read };
        made(&sources, order.clone(), Albedo::Same([0.5; 3]), Merging::Once)
    };
    let (lazy, whole) = (columns(false), columns(true));
    let front = Mat4::from_translation(glam::Vec3::new(-512.0, -512.0, 0.0));
    let behind = Mat4::from_translation(glam::Vec3::new(0.0, 0.0, -1805.0));
    let back = behind * Mat4::from_rotation_y(std::f32::consts::PI) * front;
    let picture = |columns: &Columns, detail_px: f32, half_extent: f32| {
        let view = View { half_extent: [half_extent; 2], ..view(false, detail_px) };
        let cloud = |view_from_cloud: Mat4, first: u32| Cloud {
            geometry: (columns.order().is_some()).then_some(geometry),
            view_from_cloud,
            first,
            ..placed(columns)
        };
        let clouds = [cloud(front, 1), cloud(back, 1 + N)];
        let parts = Parts { mode: Mode::Blended, winners: true, material: false, object: false };
        let mut picture = Picture::default();
        draw(&clouds, &view, parts, &linear(), &mut picture);
        (picture.winners, picture.packed)
    };
    let groups = || (0..N as usize / GROUP).step_by(PART_GROUPS);
    let n_made = || groups().filter(|group| lazy.missing_part(*group).is_none()).count();
    for (detail_px, half_extent, n_parts) in [(9.0, 1.0, 0), (1.0, 0.02, 3), (0.0, 1.0, 640)] {
        let bits = picture(&lazy, detail_px, half_extent);
        assert!(bits.0.iter().any(|winner| winner[0] != 0));
        assert!(bits == picture(&whole, detail_px, half_extent), "{detail_px}");
        assert_eq!(n_made(), n_parts, "{detail_px}");
        assert_eq!(lazy.bytes() < whole.bytes(), n_parts < 640, "{detail_px}");
    }
}
