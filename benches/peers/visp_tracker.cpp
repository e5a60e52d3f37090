// ViSP's generic model-based tracker, by moving edges, on pairs of images: `peers/visp.py` writes them and reads what this makes of them.
//
// Usage: visp_tracker MODEL LEFT_XML RIGHT_XML RIGHT_FROM_LEFT START PAIRS OUT. RIGHT_FROM_LEFT and START, the first pose of the model
// in the left camera, have the rows of a 4 x 4; PAIRS has a line with two PGM files for each pair. OUT gets a line for each: the 16
// numbers of the pose and the milliseconds of the processor; after a failure nothing more.

#include <ctime>
#include <fstream>
#include <iostream>
#include <string>

#include <visp3/core/vpHomogeneousMatrix.h>
#include <visp3/io/vpImageIo.h>
#include <visp3/mbt/vpMbGenericTracker.h>

namespace {

vpHomogeneousMatrix read(const std::string &path) {
  std::ifstream file(path);
  vpHomogeneousMatrix matrix;
  for (unsigned int row = 0; row < 4; ++row)
    for (unsigned int column = 0; column < 4; ++column)
      file >> matrix[row][column];
  return matrix;
}

}  // namespace

int main(int count, char **arguments) {
  if (count != 8) return 2;
  const std::string model = arguments[1];
  vpMbGenericTracker tracker(2, vpMbGenericTracker::EDGE_TRACKER);
  tracker.loadConfigFile(arguments[2], arguments[3], false);
  tracker.loadModel(model, model);
  tracker.setCameraTransformationMatrix({{"Camera1", vpHomogeneousMatrix()}, {"Camera2", read(arguments[4])}});
  std::ifstream pairs(arguments[6]);
  std::ofstream out(arguments[7]);
  std::string left, right;
  bool is_first = true;
  out.precision(12);
  while (pairs >> left >> right) {
    vpImage<unsigned char> images[2];
    vpImageIo::read(images[0], left);
    vpImageIo::read(images[1], right);
    const std::clock_t begin = std::clock();
    try {
      if (is_first) {
        const vpHomogeneousMatrix start = read(arguments[5]);
        tracker.initFromPose(images[0], images[1], start, read(arguments[4]) * start);
      }
      is_first = false;
      tracker.track(images[0], images[1]);
    } catch (const vpException &error) {
      std::cerr << left << ": " << error.getMessage() << '\n';
      break;
    }
    const double took = 1000.0 * static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
    vpHomogeneousMatrix pose;
    tracker.getPose(pose);
    for (unsigned int row = 0; row < 4; ++row)
      for (unsigned int column = 0; column < 4; ++column)
        out << pose[row][column] << ' ';
    out << took << '\n';
  }
  return 0;
}
