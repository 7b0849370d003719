/* The header that an Arduino sketch includes. SPDX-License-Identifier: MIT-0 */
#include "hopform/hopform.h"
