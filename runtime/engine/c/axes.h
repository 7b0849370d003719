/* SPDX-License-Identifier: MIT-0
 *
 * Places in the vector z = (1, x_1 - x_1(0), y, v_1, v_2) of a mode as a linear system.
 */
#ifndef HOPFORM_AXES_H
#define HOPFORM_AXES_H

enum { Z_ONE, Z_X, Z_Y, Z_V1, Z_V2, Z_SIZE };

#endif
