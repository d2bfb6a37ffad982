#pragma once

/// Arms: what a driver does (`Arm`), and the simulated arm. A driver of your own derives from `Arm`.

#include "steadyhand/arms/driver/simulated_arm.hpp"
