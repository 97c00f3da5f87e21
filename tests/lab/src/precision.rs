//! Prints how far results are from f64 where textbook forms fail, beside those forms.

pub(crate) fn run() -> anyhow::Result<()> {
    println!("| computed | figure | textbook form | error | form used | error |");
    println!("|---|---|---|---|---|---|");
    for figure in surfelshop_tests::precision::figures()? {
        let ((before, error_before), (after, error_after)) = (figure.before, figure.after);
        println!(
            "| {} | {} | {before} | {error_before:.2e} | {after} | {error_after:.2e} |",
            figure.what, figure.measure
        );
    }
    Ok(())
}
