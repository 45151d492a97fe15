# norton+time-hardening: Norton power law (PL) + Norton-Bailey time-hardening power law (TPL)
#
# rate = A_1*stress**n_1    [power law]
#      + A_2*stress**n_2*time**m    [time hardening]
#
# Numbers below are in MPa and s, temperatures in K: stress is a ratio to 1 MPa, time to 1 s, rates are per s.
# Parameters, for stress as a ratio to 1 MPa and time to 1 s:
#   A_1 = 1e-16 1/s, rate coefficient (MPa^-n_1 s^-1 for stress in MPa and time in s)
#   n_1 = 5.0, stress exponent
#   A_2 = 1e-12 1/s, rate coefficient (MPa^-n_2 s^-(m + 1) for stress in MPa and time in s)
#   n_2 = 4.0, stress exponent
#   m = -0.7, time exponent
# Note: n = 5.2 [5.1, 5.3]
# Note: valid from 973 to 1123 K
# Source: Norton (1929), The Creep of Steel at High Temperatures, McGraw-Hill
# Source: Bailey (1935), The Utilization of Creep Test Data in Engineering Design, Proc. Inst. Mech. Eng. 131,
#     131-349
# Source: H. Chen, R. Zhou, R. Zha, Z. Chen, W. Li, R. Rolark, J. P. Reidy, J. Cao, I. McCue, P. Guo, D. C.
#     Dunand, H. D. Espinosa, Machine Learning-Driven Creep Law Discovery Across Alloy Compositional Space
#     (manuscript), Table 1
#
# PowerLawCreepStressUpdate: rate = coefficient s^n_exponent exp(-activation_energy/(gas_constant T)) (t -
#     start_time)^m_exponent, of equivalent stress s; ComputeMultipleInelasticStress adds the models. t is the
#     analysis time: start_time is when the load begins. It takes strain = FINITE, or incremental = true.
# 'power law' is called power_law here
# 'time hardening' is called time_hardening here
[Materials]
  [power_law]
    type = PowerLawCreepStressUpdate
    coefficient = 1e-16
    n_exponent = 5
    m_exponent = 0
    activation_energy = 0
    base_name = power_law
  []
  [time_hardening]
    type = PowerLawCreepStressUpdate
    coefficient = 1e-12
    n_exponent = 4
    m_exponent = -0.7
    activation_energy = 0
    start_time = 0
    base_name = time_hardening
  []
  [stress]
    type = ComputeMultipleInelasticStress
    inelastic_models = 'power_law time_hardening'
  []
[]
