#pragma once

/// Arms: what a driver does (`Arm`), and the simulated arm. Your driver derives from `Arm`.

#include "steadyhand/arms/driver/simulated_arm.hpp"
