# What `cmake --install` puts where, in the components program and development, and the Debian packages that
# `cpack` makes of them.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

# program: what a user runs and reads.
install(TARGETS sidewall RUNTIME COMPONENT program)
install(DIRECTORY configs/ DESTINATION ${CMAKE_INSTALL_DATADIR}/sidewall/configs COMPONENT program
        PATTERN pictures EXCLUDE)
install(FILES README.md CHANGELOG.md CITATION.cff LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT program)
install(DIRECTORY configs/pictures DESTINATION ${CMAKE_INSTALL_DOCDIR}/configs COMPONENT program)  # shown by the README
install(DIRECTORY docs DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT program PATTERN "*.sh" EXCLUDE)

if(TARGET sidewall_mpi)
  install(TARGETS sidewall_mpi LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/sidewall COMPONENT mpi)
endif()

# The program writes its own manual page and completions.
install(CODE "
  set(sidewall_program \"$<TARGET_FILE:sidewall>\")
  set(sidewall_made \"${CMAKE_BINARY_DIR}/made\")
  set(sidewall_man \"${CMAKE_INSTALL_MANDIR}\")
  set(sidewall_data \"${CMAKE_INSTALL_DATADIR}\")" COMPONENT program)
install(CODE [[
  function(sidewall_writes folder name)
    file(MAKE_DIRECTORY "${sidewall_made}")
    execute_process(COMMAND "${sidewall_program}" ${ARGN} OUTPUT_FILE "${sidewall_made}/${name}"
                    COMMAND_ERROR_IS_FATAL ANY)
    file(INSTALL "${sidewall_made}/${name}" DESTINATION "${CMAKE_INSTALL_PREFIX}/${folder}")
  endfunction()
  set(sidewall_zsh site-functions)
  if("${CMAKE_INSTALL_PREFIX}" MATCHES "/usr$")  # where Debian's zsh finds those of packages
    set(sidewall_zsh vendor-completions)
  endif()
  sidewall_writes(${sidewall_man}/man1 sidewall.1 man)
  sidewall_writes(${sidewall_data}/bash-completion/completions sidewall completion bash)
  sidewall_writes(${sidewall_data}/zsh/${sidewall_zsh} _sidewall completion zsh)
  sidewall_writes(${sidewall_data}/fish/vendor_completions.d sidewall.fish completion fish)
]] COMPONENT program)

# development: headers, static libraries and find_package(Sidewall).
set(config_dir ${CMAKE_INSTALL_LIBDIR}/cmake/Sidewall)
set(include_dir ${CMAKE_INSTALL_INCLUDEDIR}/sidewall)
foreach(library surface levelset simplify flux)
  install(TARGETS sidewall_${library} ARCHIVE COMPONENT development)
  install(DIRECTORY ${library} DESTINATION ${include_dir} COMPONENT development FILES_MATCHING PATTERN *.hpp)
endforeach()
install(TARGETS sidewall_extraction ARCHIVE COMPONENT development)
configure_package_config_file(app/package/SidewallConfig.cmake.in ${CMAKE_BINARY_DIR}/SidewallConfig.cmake
                              INSTALL_DESTINATION ${config_dir} PATH_VARS CMAKE_INSTALL_LIBDIR include_dir)
write_basic_package_version_file(${CMAKE_BINARY_DIR}/SidewallConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/SidewallConfig.cmake ${CMAKE_BINARY_DIR}/SidewallConfigVersion.cmake
        DESTINATION ${config_dir} COMPONENT development)

# Debian packages, one a component.
set(CPACK_GENERATOR DEB)
set(CPACK_COMPONENTS_ALL program development)
if(TARGET sidewall_python)
  list(APPEND CPACK_COMPONENTS_ALL python)
  math(EXPR next_python "${Python3_VERSION_MINOR} + 1")
endif()
if(TARGET sidewall_mpi)
  list(APPEND CPACK_COMPONENTS_ALL mpi)
endif()
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_PACKAGE_CONTACT "Sidewall developers")
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME sidewall)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME sidewall-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
# Depends: what all libraries need. Recommends: Embree (surface, flux, extraction, levelset), OpenVDB (the last two), Clipper (levelset).
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "libeigen3-dev, libtbb-dev, libfmt-dev")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_RECOMMENDS
    "cmake, libembree-dev, libopenvdb-dev, libboost-iostreams-dev, zlib1g-dev, libexpat1-dev, libpolyclipping-dev")
set(CPACK_COMPONENT_PROGRAM_DESCRIPTION
    "The program, its manual page, and recipes to begin with in /usr/share/sidewall/configs.")
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION
    "Its libraries for C++ programs: meshes, level sets, mesh simplification, flux tracing; each may be used alone.")
set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-sidewall)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SHLIBDEPS ON)
# The compiled module works with one minor version of the interpreter only.
set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS
    "sidewall (= ${PROJECT_VERSION}), python3-numpy, python3 (>= 3.${Python3_VERSION_MINOR}), python3 (<< 3.${next_python})")
set(CPACK_COMPONENT_PYTHON_DESCRIPTION
    "Its Python package: recipes and runs in scripts, models in Python, mesh functions on NumPy arrays.")
set(CPACK_DEBIAN_MPI_PACKAGE_NAME sidewall-mpi)
set(CPACK_DEBIAN_MPI_PACKAGE_SECTION science)
set(CPACK_DEBIAN_MPI_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_MPI_PACKAGE_DEPENDS "sidewall (= ${PROJECT_VERSION}), openmpi-bin")
set(CPACK_COMPONENT_MPI_DESCRIPTION "Lets mpirun share one run over processes and machines.")
if(SIDEWALL_ARCH STREQUAL "x86-64-v3")
  string(APPEND CPACK_COMPONENT_PROGRAM_DESCRIPTION "\nNeeds a processor with AVX2.")
endif()
include(CPack)
