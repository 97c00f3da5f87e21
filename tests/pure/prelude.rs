//! A renderer, a tracer and a tool that name nothing but the prelude.

use surfelshop_api::prelude::*;

params! {
    /// Settings of all units.
    pub struct Settings {
        /// Factor on what is drawn.
        gain: f32 { default: 1.0, range: 0.0..=4.0 },
        /// A table.
        file: FilePath { default: FilePath::default() },
    }
}

const NEEDS: &[NeedInfo] = &[NeedInfo::column(columns::SPLAT_SCALE, 3)];

/// Draws splats seen by a camera of its own.
struct Drawn;

/// What is read of each surfel.
fn read(facts: &CloudFacts, graph: &mut Graph) -> (u64, Columns) {
    let is_large = |cloud: &CloudInfo| cloud.n_surfels > 1;
    let mine = facts.fulfilling(NEEDS);
    assert!(facts.clouds.iter().all(is_large));
    let read =
        [BufferColumn::new(columns::POSITION, 3), BufferColumn::new(columns::SPLAT_SCALE, 3)];
    graph.columns("cloud", facts, &mine, &read)
}

/// A texture of half the view.
fn half(graph: &mut Graph, view: &View) -> TextureId {
    let [width, height] = view.size_px;
    graph.texture("half", Texture::fixed(Format::Rgba32Float, width / 2, height / 2))
}

impl Renderer for Drawn {
    const INFO: UnitInfo = UnitInfo::new("drawn", "Drawn", "Names the prelude alone.");
    type Params = Settings;
    const NEEDS: &'static [NeedInfo] = NEEDS;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn frame(&mut self, frame: &Frame<Settings>, graph: &mut Graph) -> Result<()> {
        let settings = graph.settings("params", Members::of(&frame.params).u32("n", 3));
        let (n, cloud) = read(&frame.cloud, graph);
        let half = half(graph, &frame.view);
        graph.pass(
            Pass::splats("splats", "", "draw", Footprint::Conic, n)
                .composed(Composition::Over)
                .reads(&cloud)
                .settings(&settings)
                .target(Target::from(half)),
        );
        graph.output(Output::Color, half);
        Ok(())
    }
}

/// Writes how tall each pixel is in a file.
struct Table;

impl Tracer for Table {
    const INFO: UnitInfo = UnitInfo::new("table", "Table", "Names the prelude alone.");
    type Params = Settings;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn tile(
        &self,
        frame: &Frame<Settings>,
        _scene: &Traced<'_>,
        _tile: Tile,
        pixels: &mut [f32],
        job: &Job<'_>,
    ) -> Result<()> {
        job.check()?;
        let path = &frame.params.file;
        let text = std::fs::read_to_string(path).at(path)?;
        let value =
            text.trim().parse::<f32>().map_err(|_other| Error::new("no number").at(path))?;
        pixels.fill(value);
        Ok(())
    }
}

/// Stores a column.
struct Ones;

impl Tool for Ones {
    const INFO: UnitInfo = UnitInfo::new("ones", "Ones", "Names the prelude alone.");
    type Params = Settings;
    const SCOPE: Scope = Scope::Surfel;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn run(&mut self, cloud: &CloudView<'_>, params: &Settings, job: &Job<'_>) -> Result<()> {
        let ones = job.map(cloud.len, 0.0..1.0, |_| params.gain)?;
        let values = Values::F32(&ones);
        job.edit(&Edit::Columns(vec![NewColumn { name: columns::AO, components: 1, values }]))
    }
}

surfelshop_api::static_plugin! {
    id: "org.surfelshop.test.prelude",
    renderers: [Drawn],
    tracers: [Table],
    tools: [Ones],
}

#[test]
fn units_of_each_kind_are_written_with_the_prelude_alone() {
    use surfelshop_api::abi::plugin_side::Package as _;
    assert_eq!(SurfelshopPackage::UNITS.len(), 3);
    let manifest = surfelshop_api::manifest::decode(&SURFELSHOP_STATIC_MANIFEST).unwrap();
    assert_eq!(manifest.units[0].needs.len(), 1);
}

#[test]
fn errors_of_files_say_which_file_in_a_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = FilePath(folder.path().join("height.txt").display().to_string());
    let read = || -> Result<f32> {
        let text = std::fs::read_to_string(&path).at(&path)?;
        text.trim().parse::<f32>().at(path.as_path())
    };
    let gone = read().unwrap_err().to_string();
    assert!(gone.starts_with(&format!("{path}: ")) && !gone.contains('\n'), "{gone}");
    std::fs::write(&path, "tall").unwrap();
    let wrong = read().unwrap_err().to_string();
    assert_eq!(wrong, format!("{path}: invalid float literal"));
    std::fs::write(&path, "2.5").unwrap();
    assert_eq!(read().unwrap(), 2.5);
    assert!(FilePath::default().is_empty() && !path.is_empty());
}
