//! Gathers what the tests of faults have measured: `gather FOLDER RUN` prints
//! the file that `docs/faults.md` is made from.

use std::{path::Path, process::ExitCode};

use fitmac_tests::faults::Measured;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [folder, run] = arguments.as_slice() else {
        eprintln!("usage: gather FOLDER RUN");
        return ExitCode::from(2);
    };
    match Measured::gather(run.clone(), Path::new(folder)) {
        Ok(measured) => {
            println!(
                "{}",
                serde_json::to_string_pretty(&measured).expect("numbers and names")
            );
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("gather: {folder}: {error}");
            ExitCode::FAILURE
        }
    }
}
