# The C++ library: its public headers, the targets sheetbend::sheetbend and sheetbend::ceres, and what find_package(sheetbend) reads.
include(CMakePackageConfigHelpers)
include(GNUInstallDirs)

find_package(nlohmann_json 3.10 CONFIG QUIET)  # reads the headers of scenes' files; needed to build, not to use
if(NOT nlohmann_json_FOUND)
  message(FATAL_ERROR "SHEETBEND_LIBRARY=ON: nlohmann_json 3.10 was not found. Fix: install nlohmann-json3-dev (Debian, Ubuntu), "
                      "or give -DSHEETBEND_LIBRARY=OFF.")
endif()

set(library_dir ${PROJECT_SOURCE_DIR}/adjoint/library)
set(generated_dir ${PROJECT_BINARY_DIR}/include)
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/sheetbend)
configure_file(${library_dir}/sheetbend/version.h.in ${generated_dir}/sheetbend/version.h @ONLY)

file(GLOB library_sources CONFIGURE_DEPENDS ${library_dir}/*.cpp)
add_library(sheetbend STATIC ${library_sources})
add_library(sheetbend::sheetbend ALIAS sheetbend)
sheetbend_compile_together(sheetbend 6)
target_compile_definitions(sheetbend PRIVATE SHEETBEND_BUILDING)
target_compile_features(sheetbend PUBLIC cxx_std_20)
target_include_directories(sheetbend PUBLIC "$<BUILD_INTERFACE:${library_dir};${generated_dir}>"
                                            $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
target_link_libraries(sheetbend PRIVATE sheetbend_core $<BUILD_INTERFACE:nlohmann_json::nlohmann_json>)

# In a component of its own: a wheel installs the component `python`.
install(TARGETS sheetbend sheetbend_core EXPORT sheetbend ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT library)
install(DIRECTORY ${library_dir}/sheetbend ${generated_dir}/sheetbend DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}
        COMPONENT library FILES_MATCHING PATTERN "*.h")
install(EXPORT sheetbend NAMESPACE sheetbend:: FILE sheetbend-targets.cmake DESTINATION ${package_dir} COMPONENT library)

# sheetbend::ceres is a header over the library: nothing of Ceres is compiled into sheetbend::sheetbend. Only where this build found Ceres do both use
# one Eigen (Dependencies.cmake).
if(Ceres_FOUND)
  add_library(sheetbend_residuals INTERFACE)
  set_target_properties(sheetbend_residuals PROPERTIES EXPORT_NAME ceres)
  add_library(sheetbend::ceres ALIAS sheetbend_residuals)
  target_link_libraries(sheetbend_residuals INTERFACE sheetbend Ceres::ceres)
  install(TARGETS sheetbend_residuals EXPORT sheetbend_ceres COMPONENT library)
  install(EXPORT sheetbend_ceres NAMESPACE sheetbend:: FILE sheetbend-ceres-targets.cmake DESTINATION ${package_dir}
          COMPONENT library)
endif()

configure_package_config_file(cmake/sheetbend-config.cmake.in ${PROJECT_BINARY_DIR}/sheetbend-config.cmake
                              INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/sheetbend-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/sheetbend-config.cmake ${PROJECT_BINARY_DIR}/sheetbend-config-version.cmake
        DESTINATION ${package_dir} COMPONENT library)
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/licenses/sheetbend COMPONENT library)
install(DIRECTORY licenses/ DESTINATION ${CMAKE_INSTALL_DATADIR}/licenses/sheetbend COMPONENT library)
