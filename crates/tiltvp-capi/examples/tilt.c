// The tilt and the vertical lines of one picture: `tilt CAMERA.toml IMAGE.pgm [OPTIONS]`, with options in TOML.

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>

#include "tiltvp.h"

#define LINES 256

// The next number of a PGM's header, past its comments; -1 if there is none.
static long number(FILE *file) {
    int letter = getc(file);
    while (letter == '#' || isspace(letter)) {
        while (letter == '#' && letter != EOF) {
            do letter = getc(file);
            while (letter != '\n' && letter != EOF);
        }
        letter = getc(file);
    }
    long value = -1;
    for (; isdigit(letter) && value < 1000000; letter = getc(file)) value = (value < 0 ? 0 : 10 * value) + (letter - '0');
    return value; // The one space after it is read too.
}

// The grey levels of a binary PGM of 8 bits; NULL if it is none. The caller frees them.
static unsigned char *read_pgm(const char *path, size_t *width, size_t *height) {
    FILE *file = fopen(path, "rb");
    if (file == NULL) return NULL;
    unsigned char *levels = NULL;
    if (getc(file) == 'P' && getc(file) == '5') {
        const long columns = number(file), rows = number(file), most = number(file);
        if (columns > 0 && rows > 0 && most == 255) {
            *width = (size_t)columns;
            *height = (size_t)rows;
            levels = malloc(*width * *height);
            if (levels != NULL && fread(levels, *width, *height, file) != *height) {
                free(levels);
                levels = NULL;
            }
        }
    }
    fclose(file);
    return levels;
}

static TiltvpStatus look(const TiltvpCamera *camera, const TiltvpImage *image, const char *options) {
    TiltvpTiltEstimator *estimator = NULL;
    TiltvpLineExtractor *extractor = NULL;
    TiltvpTiltEstimate found;

    // The tables of a camera are made once; one estimator serves many images and threads.
    TiltvpStatus status = tiltvp_tilt_estimator_new(camera, NULL, NULL, options, &estimator);
    if (status == TILTVP_STATUS_OK) status = tiltvp_tilt_estimator_estimate(estimator, image, &found);
    if (status == TILTVP_STATUS_OK && found.valid) {
        printf("alpha %.4f beta %.4f rad, confidence %.2f: %s\n", found.alpha_rad, found.beta_rad, found.confidence,
               found.reason);
    } else if (status == TILTVP_STATUS_OK) {
        printf("no tilt: %s\n", found.reason);
    }

    // The lines stand upright by that tilt.
    if (status == TILTVP_STATUS_OK) status = tiltvp_line_extractor_new(camera, NULL, NULL, NULL, &extractor);
    if (status == TILTVP_STATUS_OK) {
        TiltvpLine lines[LINES];
        size_t count;
        status = tiltvp_line_extractor_extract(extractor, image, found.valid ? found.normal : NULL, lines, LINES, &count);
        for (size_t i = 0; status == TILTVP_STATUS_OK && i < count; i++) {
            printf("line at %.4f rad, sigma %.5f\n", lines[i].bearing_rad, lines[i].sigma_rad);
        }
    }
    tiltvp_line_extractor_free(extractor);
    tiltvp_tilt_estimator_free(estimator);
    return status;
}

int main(int count, char **arguments) {
    if (count < 3) {
        fprintf(stderr, "tilt CAMERA.toml IMAGE.pgm [OPTIONS]\n");
        return 2;
    }
    TiltvpImage image = {0};
    unsigned char *levels = read_pgm(arguments[2], &image.width, &image.height);
    if (levels == NULL) {
        fprintf(stderr, "%s: expected a binary PGM of 8 bits\n", arguments[2]);
        return 2;
    }
    image.data = levels;
    image.stride = image.width;

    TiltvpCamera *camera = NULL;
    TiltvpStatus status = tiltvp_camera_load(arguments[1], NULL, &camera);
    if (status == TILTVP_STATUS_OK) status = look(camera, &image, count > 3 ? arguments[3] : NULL);
    if (status != TILTVP_STATUS_OK) fprintf(stderr, "%s\n", tiltvp_last_error());
    tiltvp_camera_free(camera);
    free(levels);
    return status == TILTVP_STATUS_OK ? 0 : 1;
}
