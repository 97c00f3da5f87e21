// Puts what pixels need of the lights of a bounce behind those of the bounces before.
#import gi::material::Material
#import gi::vpl::Vpl
#import gi::vpl::Sender
#import gi::vpl::Shine
#import gi::vpl

struct Place {
    count: u32,
    first: u32,
}

var<uniform> place: Place;
var<uniform> body: Material;
var<storage, read> latest: array<Vpl>;
var<storage, read_write> senders: array<Sender>;
var<storage, read_write> shines: array<Shine>;

@compute @workgroup_size(64)
fn collect(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < place.count {
        let v = latest[id.x];
        let matte = v.flux * v.albedo * body.diffuse;
        senders[place.first + id.x] = Sender(v.position, v.alive, v.normal, v.cosine, matte, 0u);
        if place.first + id.x < arrayLength(&shines) {
            shines[place.first + id.x] = Shine(v.flux, 0u, v.incoming, 0u);
        }
    }
}
