// The scene's surfels as data: what a buffer holds that the host fills with them.
//
// Authors declare `var<storage, read> NAME: array<surfels::Record>` and bind what `Graph::surfels`
// gave. A buffer may hold only some of the scene's surfels, evenly spread.
#define_import_path surfelshop::surfels

#import surfelshop::packing

// A surfel as it is stored, 32 bytes.
struct Record {
    // From the scene's origin, world-oriented, scene units.
    position: vec3<f32>,
    // Scene units, the scene's factor included; of an ellipse the radius of the disc of its area. 0 is no
    // surfel.
    radius: f32,
    normal: u32,
    albedo_rg: u32,
    albedo_b: u32,
    // Which of the scene's clouds it belongs to, from 0.
    object: u32,
}

// A surfel of the scene.
struct Surfel {
    // From the scene's origin, world-oriented, scene units: `view::view.world_from_view[3].xyz` is where
    // the eye is, from there.
    position: vec3<f32>,
    // Scene units; 0 is no surfel.
    radius: f32,
    // Unit, world-oriented, as the cloud has it.
    normal: vec3<f32>,
    // Linear Rec. 709.
    albedo: vec3<f32>,
    // Which of the scene's clouds it belongs to, from 0.
    object: u32,
}

fn surfel_of(record: Record) -> Surfel {
    let blue = unpack2x16float(record.albedo_b).x;
    return Surfel(
        record.position,
        record.radius,
        packing::unpack_direction(record.normal),
        vec3(unpack2x16float(record.albedo_rg), blue),
        record.object,
    );
}
