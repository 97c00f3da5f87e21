use crate::buffer::Buffer;
use crate::cloud::Cloud;
use crate::column::Column;
use crate::error::CloudError;
use surfelshop_api::Edit;
use surfelshop_api::tool::NewColumn;

impl From<&NewColumn<'_>> for Column {
    fn from(new: &NewColumn<'_>) -> Self {
        Self::new(new.name, new.components, Buffer::from_values(&new.values))
    }
}

impl Cloud {
    /// The cloud after a tool's edit; the cloud itself stays as it was, for undo.
    ///
    /// # Errors
    /// Where the edit does not fit the cloud, as in [`Cloud::new`].
    pub fn edited(&self, edit: &Edit<'_>) -> Result<Self, CloudError> {
        match edit {
            Edit::Columns(columns) => self.with_columns(columns.iter().map(Column::from).collect()),
            Edit::Keep(mask) => self.keep(mask),
            Edit::NewCloud { origin, columns } => {
                Self::new(*origin, columns.iter().map(Column::from).collect())
            }
        }
    }
}
