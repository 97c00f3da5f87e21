"""The rows of a report."""


class Table(list):
    """Rows, each a dictionary of column and value."""

    def to_pandas(self):
        """The same as a table of pandas, which has to be installed."""
        import pandas

        return pandas.DataFrame(list(self))

    def _repr_html_(self):
        from html import escape

        names = list(dict.fromkeys(name for row in self for name in row))
        cell = lambda value: escape(f"{value:.5g}" if isinstance(value, float) else "" if value is None else str(value))
        head = "".join(f"<th>{escape(name)}</th>" for name in names)
        rows = ("".join(f"<td>{cell(row.get(name))}</td>" for name in names) for row in self)
        return f"<table><tr>{head}</tr>{''.join(f'<tr>{row}</tr>' for row in rows)}</table>"
