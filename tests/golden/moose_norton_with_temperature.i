# norton*arrhenius: Norton power law (PL) with Arrhenius temperature dependence
#
# rate = A*stress**n*exp(-Q/R*(1/T - 1/1073.15))    [power law]
#
# Numbers below are in Pa and s, temperatures in K: stress is a ratio to 1 Pa, time to 1 s, rates are per s.
# Parameters, for stress as a ratio to 1 MPa and time to 1 s:
#   A = 1.2e-16 1/s, rate coefficient (MPa^-n s^-1 for stress in MPa and time in s)
#   n = 5.2, stress exponent
#   Q = 400000.0 J/mol, activation energy
# Note: n = 5.2 [5.1, 5.3]
# Note: valid from 973 to 1123 K
# Source: Norton (1929), The Creep of Steel at High Temperatures, McGraw-Hill
# Source: Arrhenius (1889), Z. Phys. Chem. 4, 226
#
# PowerLawCreepStressUpdate: rate = coefficient s^n_exponent exp(-activation_energy/(gas_constant T)) (t -
#     start_time)^m_exponent, of equivalent stress s; ComputeMultipleInelasticStress adds the models. t is the
#     analysis time: start_time is when the load begins. It takes strain = FINITE, or incremental = true.
# The variable called temperature must be in K.
# 'power law' is called power_law here
[Materials]
  [elasticity]
    type = ComputeIsotropicElasticityTensor
    youngs_modulus = 150000000000
    poissons_ratio = 0.3
  []
  [power_law]
    type = PowerLawCreepStressUpdate
    coefficient = 2.230756306972e-28
    n_exponent = 5.2
    m_exponent = 0
    activation_energy = 400000
    gas_constant = 8.314462618
    temperature = temperature
  []
  [stress]
    type = ComputeMultipleInelasticStress
    inelastic_models = 'power_law'
  []
[]
