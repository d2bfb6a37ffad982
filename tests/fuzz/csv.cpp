// A hand as CSV.
#include "fuzz/recording_rules.hpp"

FUZZ(csv) { steadyhand::fuzz::check(steadyhand::load_recording(steadyhand::fuzz::as_file(input))); }
