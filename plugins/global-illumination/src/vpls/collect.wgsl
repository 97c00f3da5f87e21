// Appends what pixels need of the lights of a bounce to those of the bounces before.
#import gi::material::Material
#import gi::vpl::Vpl
#import gi::vpl::DiffuseVpl
#import gi::vpl::SpecularVpl
#import gi::vpl

struct Place {
    count: u32,
    first: u32,
}

var<uniform> place: Place;
var<uniform> body: Material;
var<storage, read> latest: array<Vpl>;
var<storage, read_write> diffuse_vpls: array<DiffuseVpl>;
var<storage, read_write> specular_vpls: array<SpecularVpl>;

@compute @workgroup_size(64)
fn collect(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < place.count {
        let v = latest[id.x];
        let diffuse = v.flux * v.albedo * body.diffuse;
        diffuse_vpls[place.first + id.x] = DiffuseVpl(v.position, v.valid, v.normal, v.cosine, diffuse, 0u);
        if place.first + id.x < arrayLength(&specular_vpls) {
            specular_vpls[place.first + id.x] = SpecularVpl(v.flux, 0u, v.incoming, 0u);
        }
    }
}
