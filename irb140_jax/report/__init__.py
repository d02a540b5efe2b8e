"""Results as text, tables and one HTML file; computes nothing beyond scaling."""

from irb140_jax.report.folder import check_file as check_file
from irb140_jax.report.folder import check_folder as check_folder
from irb140_jax.report.folder import whole_file as whole_file
from irb140_jax.report.folder import whole_folder as whole_folder
from irb140_jax.report.html import html_report as html_report
from irb140_jax.report.proposal import proposal_sentences as proposal_sentences
from irb140_jax.report.reveal import Reveal as Reveal
from irb140_jax.report.reveal import revealed as revealed
from irb140_jax.report.terminal import print_diagnosis as print_diagnosis
from irb140_jax.report.terminal import print_reveal as print_reveal
