# find_package(plumbline): the libraries plumbline::core, sim, factors, estimator, eval and tools.
include(CMakeFindDependencyMacro)
foreach(dependency Eigen3 Ceres yaml-cpp fmt nlohmann_json Boost BZip2 CLI11 glog SQLiteCpp)
  find_dependency(${dependency})
endforeach()
find_dependency(OpenCV COMPONENTS core calib3d imgproc imgcodecs)
include(${CMAKE_CURRENT_LIST_DIR}/plumblineTargets.cmake)
