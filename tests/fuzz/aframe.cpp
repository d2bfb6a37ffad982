// A hand as A-Frame motion capture.
#include "fuzz/recording_rules.hpp"

FUZZ(aframe) {
  if (input.find_first_of("[{") != input.find_first_not_of(" \t\r\n")) return;
  steadyhand::fuzz::check(steadyhand::load_recording(steadyhand::fuzz::as_file(input)));
}
