use crate::buffer::Buffer;

/// The points of a file before they are a cloud: scalar columns under the file's own names.
#[derive(Debug, Default)]
pub(crate) struct Table {
    /// Format and encoding, for people.
    pub(crate) format: String,
    /// What the file calls its points.
    pub(crate) element: String,
    pub(crate) n_rows: usize,
    /// One value per row each; names are distinct but for case.
    pub(crate) columns: Vec<(String, Buffer)>,
    pub(crate) comments: Vec<String>,
    pub(crate) warnings: Vec<String>,
}

impl Table {
    /// Takes the columns of these names out, in this order; `None`, and nothing taken, where one is
    /// missing. Case does not matter.
    pub(crate) fn take<const N: usize>(&mut self, names: [&str; N]) -> Option<[Buffer; N]> {
        let mut places = [0; N];
        for (place, name) in places.iter_mut().zip(names) {
            *place = self.columns.iter().position(|(own, _)| own.eq_ignore_ascii_case(name))?;
        }
        let taken = places
            .map(|place| std::mem::replace(&mut self.columns[place].1, Buffer::U8(Vec::new())));
        let mut index = 0;
        self.columns.retain(|_| {
            index += 1;
            !places.contains(&(index - 1))
        });
        Some(taken)
    }

    /// The first of several spellings that is there.
    pub(crate) fn take_any<const N: usize>(
        &mut self,
        spellings: &[[&str; N]],
    ) -> Option<[Buffer; N]> {
        spellings.iter().find_map(|names| self.take(*names))
    }

    /// The rows whose entry in `mask` is true.
    pub(crate) fn keep(&mut self, mask: &[bool]) {
        for (_, buffer) in &mut self.columns {
            *buffer = buffer.select(1, mask);
        }
        self.n_rows = mask.iter().filter(|&&keep| keep).count();
    }

    /// The words after a prefix in each comment that this program wrote into the file.
    pub(crate) fn notes<'a>(&'a self, kind: &str) -> impl Iterator<Item = Vec<&'a str>> {
        self.comments.iter().filter_map(move |comment| {
            let mut words = comment.split_ascii_whitespace();
            let is_ours = words.next() == Some("surfelshop") && words.next() == Some(kind);
            is_ours.then(|| words.collect())
        })
    }
}
