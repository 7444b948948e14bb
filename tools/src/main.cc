#include <glog/logging.h>

#include "tools/program.h"

int main(int argc, char** argv) {
  google::InitGoogleLogging(argv[0]);
  return plumbline::tools::program(argc, argv);
}
