/* SPDX-License-Identifier: MIT-0
 *
 * The library in one precision, as one unit: what its parts share stands in the image once.
 */
#include "facts.h"

#if HOPFORM_HAS_CONTACT
#include "control_real.h"
#include "flight_real.h"
#include "flight_sensitivity_real.h"
#include "touchdown_real.h"
#endif
#include "energy_real.h"
#include "forces_real.h"
#include "plant_real.h"
#include "selftest_real.h"
#include "sensitivity_real.h"
#include "stance_real.h"
#include "start_real.h"
#include "states_real.h"
