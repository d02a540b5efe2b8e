"""Results as text, tables and one HTML file; computes nothing beyond scaling."""

from irb140_jax.report.html import html_report as html_report
from irb140_jax.report.made import is_our_table as is_our_table
from irb140_jax.report.made import write_table as write_table
from irb140_jax.report.outputs import results_file as results_file
from irb140_jax.report.outputs import results_folder as results_folder
from irb140_jax.report.plotjuggler import is_our_layout as is_our_layout
from irb140_jax.report.plotjuggler import write_layout as write_layout
from irb140_jax.report.proposal import proposal_sentences as proposal_sentences
from irb140_jax.report.results import Results as Results
from irb140_jax.report.reveal import Reveal as Reveal
from irb140_jax.report.reveal import revealed as revealed
from irb140_jax.report.terminal import print_diagnosis as print_diagnosis
from irb140_jax.report.terminal import print_reveal as print_reveal
