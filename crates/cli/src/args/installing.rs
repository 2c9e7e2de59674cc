//! What a package puts beside the program.

use std::path::PathBuf;

use clap::Args;
use clap_complete::Shell;

#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  sigmark completions bash > ~/.local/share/bash-completion/completions/sigmark
  sigmark completions zsh > ~/.zfunc/_sigmark
  sigmark completions fish > ~/.config/fish/completions/sigmark.fish
  sigmark completions powershell >> profile.ps1

What is printed makes the shell complete commands, options and their values when Tab is pressed. For zsh the folder has to be \
among those of fpath; for PowerShell it goes into the file that $PROFILE names.")]
pub(crate) struct Completions {
    /// Which shell
    #[arg(value_enum)]
    pub(crate) shell: Shell,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  sigmark man share/man/man1
  man -l share/man/man1/sigmark-embed.1

Writes a page for every command, for packages to install. They hold what --help says.")]
pub(crate) struct Man {
    /// The folder, made if there is none
    pub(crate) folder: PathBuf,
    /// Replace pages that exist
    #[arg(long)]
    pub(crate) force: bool,
}
