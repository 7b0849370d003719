/* SPDX-License-Identifier: MIT-0
 *
 * The library in one precision, as one unit: what its parts share stands in the image once.
 */
#include "control_real.inc"
#include "energy_real.inc"
#include "flight_real.inc"
#include "selftest_real.inc"
#include "sensitivity_real.inc"
#include "stance_real.inc"
#include "states_real.inc"
#include "touchdown_real.inc"
