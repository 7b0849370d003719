/* CVODE, Adams with fixed-point iteration or BDF with the analytic Jacobian; CVodeRootInit; reinitialised at every
 * switch. */
#include <cvode/cvode.h>
#include <nvector/nvector_serial.h>
#include <sundials/sundials_context.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>

#include "rules.h"

typedef struct {
    const leg_t *leg;
    const double *side;
} phase_mode;

static struct {
    void *cvode;
    N_Vector y;
    phase_mode mode;
} solver;

static int motion(realtype t, N_Vector y, N_Vector d, void *data)
{
    const phase_mode *mode = data;
    (void)t;
    rates(mode->leg, mode->side, N_VGetArrayPointer(y), N_VGetArrayPointer(d));
    return 0;
}

static int events(realtype t, N_Vector y, realtype *g, void *data)
{
    const phase_mode *mode = data;
    (void)t;
    event_functions(mode->leg, mode->side, N_VGetArrayPointer(y), g);
    return 0;
}

static int jacobian(realtype t, N_Vector y, N_Vector f, SUNMatrix matrix, void *data, N_Vector a, N_Vector b,
                    N_Vector c)
{
    const phase_mode *mode = data;
    (void)t, (void)y, (void)f, (void)a, (void)b, (void)c;
    for (int column = 0; column < 4; column++) {
        double unit[4] = {0.0, 0.0, 0.0, 0.0};
        unit[column] = 1.0;
        next_rates(mode->leg, mode->side, unit, SUNDenseMatrix_Column(matrix, column));
    }
    return 0;
}

static int search(const leg_t *leg, const double side[2], double z[4], double limit, double tolerance, double *took)
{
    realtype t = 0.0;
    int found[6];
    (void)tolerance;
    memcpy(N_VGetArrayPointer(solver.y), z, 4 * sizeof *z);
    solver.mode.leg = leg;
    solver.mode.side = side;
    CVodeReInit(solver.cvode, 0.0, solver.y);
    CVodeSetInitStep(solver.cvode, fmin(first_step(leg, side, z), limit));
    CVodeSetStopTime(solver.cvode, limit);
    const int flag = CVode(solver.cvode, limit, solver.y, &t, CV_NORMAL);
    memcpy(z, N_VGetArrayPointer(solver.y), 4 * sizeof *z);
    *took = t;
    if (flag == CV_ROOT_RETURN) {
        CVodeGetRootInfo(solver.cvode, found);
        for (int n = 0; n < 6; n++) {
            if (found[n] != 0) {
                return n;
            }
        }
    }
    return flag < 0 ? FAILED : NONE;
}

static RUN_ALL(run_with_solver)

static void run(int method, const double *jobs, int count, double tolerance, int loops, double *answers)
{
    SUNContext context;
    int falling[6] = {-1, -1, -1, -1, -1, -1};
    SUNContext_Create(NULL, &context);
    solver.y = N_VNew_Serial(4, context);
    N_VConst(0.0, solver.y);
    solver.cvode = CVodeCreate(method, context);
    CVodeInit(solver.cvode, motion, 0.0, solver.y);
    CVodeSStolerances(solver.cvode, tolerance, 0.01 * tolerance);
    CVodeSetUserData(solver.cvode, &solver.mode);
    CVodeRootInit(solver.cvode, 6, events);
    CVodeSetRootDirection(solver.cvode, falling);
    CVodeSetNoInactiveRootWarn(solver.cvode);
    CVodeSetMaxNumSteps(solver.cvode, 1000000);
    CVodeSetErrFile(solver.cvode, NULL);
    SUNMatrix matrix = SUNDenseMatrix(4, 4, context);
    SUNLinearSolver linear = SUNLinSol_Dense(solver.y, matrix, context);
    SUNNonlinearSolver nonlinear = SUNNonlinSol_FixedPoint(solver.y, 0, context);
    if (method == CV_BDF) {
        CVodeSetLinearSolver(solver.cvode, linear, matrix);
        CVodeSetJacFn(solver.cvode, jacobian);
    } else {
        CVodeSetNonlinearSolver(solver.cvode, nonlinear);
    }
    run_with_solver(jobs, count, tolerance, loops, answers);
    CVodeFree(&solver.cvode);
    SUNNonlinSolFree(nonlinear);
    SUNLinSolFree(linear);
    SUNMatDestroy(matrix);
    N_VDestroy(solver.y);
    SUNContext_Free(&context);
}

void run_adams(const double *jobs, int count, double tolerance, int loops, double *answers)
{
    run(CV_ADAMS, jobs, count, tolerance, loops, answers);
}

void run_bdf(const double *jobs, int count, double tolerance, int loops, double *answers)
{
    run(CV_BDF, jobs, count, tolerance, loops, answers);
}
