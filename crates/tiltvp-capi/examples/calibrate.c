// Where a camera sits on a robot, from a log on standard input: `calibrate WHEEL_BASE_M < LOG`.
//
// Lines of `move LEFT_M RIGHT_M` and, for what is then seen, `see LANDMARK BEARING_RAD`.

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

#include "tiltvp.h"

#define SEEN 64

int main(int count, char **arguments) {
    TiltvpSelfCalibrator *calibrator = NULL;
    TiltvpStatus status = TILTVP_STATUS_INVALID_ARGUMENT;
    if (count != 2) {
        fprintf(stderr, "calibrate WHEEL_BASE_M < LOG\n");
        return 2;
    }
    status = tiltvp_self_calibrator_new(atof(arguments[1]), NULL, &calibrator);

    double left = 0.0, right = 0.0, bearings[SEEN];
    uint64_t landmarks[SEEN];
    size_t seen = 0;
    int moved = 0;
    char line[128];
    while (status == TILTVP_STATUS_OK) {
        const int more = fgets(line, sizeof line, stdin) != NULL;
        const int moves = more && line[0] == 'm';
        if (moved && (moves || !more)) {
            status = tiltvp_self_calibrator_step(calibrator, left, right, landmarks, bearings, seen, NULL);
            seen = 0;
        }
        if (!more) break;
        if (moves && sscanf(line, "move %lf %lf", &left, &right) == 2) {
            moved = 1;
        } else if (seen < SEEN && sscanf(line, "see %" SCNu64 " %lf", &landmarks[seen], &bearings[seen]) == 2) {
            seen++;
        } else {
            fprintf(stderr, "not understood: %s", line);
            tiltvp_self_calibrator_free(calibrator);
            return 2;
        }
    }

    // The last look at the log is the thorough one.
    TiltvpMountingEstimate found = {0};
    if (status == TILTVP_STATUS_OK) status = tiltvp_self_calibrator_examine(calibrator);
    if (status == TILTVP_STATUS_OK) status = tiltvp_self_calibrator_estimate(calibrator, &found);
    if (status == TILTVP_STATUS_OK) {
        printf("x %.3f m, y %.3f m, yaw %.4f rad: %s\n", found.x_m, found.y_m, found.yaw_rad, found.reason);
    } else {
        fprintf(stderr, "%s\n", tiltvp_last_error());
    }
    tiltvp_self_calibrator_free(calibrator);
    return status == TILTVP_STATUS_OK && found.reliable ? 0 : 1;
}
