# norton+norton*arrhenius: Norton power law (PL) + Norton power law (PL) with Arrhenius temperature dependence
#
# rate = A_1*stress**n_1*exp(-Q/R*(1/T - 1/1073.15))    [power law 1]
#      + A_2*stress**n_2*exp(-Q/R*(1/T - 1/1073.15))    [power law 2]
#
# Numbers below are in MPa and s, temperatures in K: stress is a ratio to 1 MPa, time to 1 s, rates are per s.
# Parameters, for stress as a ratio to 1 MPa and time to 1 s:
#   A_1 = 1e-12 1/s, rate coefficient (MPa^-n_1 s^-1 for stress in MPa and time in s)
#   n_1 = 3.0, stress exponent
#   A_2 = 1e-18 1/s, rate coefficient (MPa^-n_2 s^-1 for stress in MPa and time in s)
#   n_2 = 6.0, stress exponent
#   Q = 300000.0 J/mol, activation energy
# Note: n = 5.2 [5.1, 5.3]
# Note: valid from 973 to 1123 K
# Source: Norton (1929), The Creep of Steel at High Temperatures, McGraw-Hill
# Source: Arrhenius (1889), Z. Phys. Chem. 4, 226
#
# For NEML2 3.1. PerzynaPlasticFlowRate: rate = (s/reference_stress)^exponent, of the von Mises stress s,
#     which stands in the place of the yield function. The model called `model` makes the stress of strain E
#     and time t.
# Reference stresses: reference_value exp(-activation_energy/(R T)), T the input called temperature, in K.
# 'power law 1' is called power_law_1 here
# 'power law 2' is called power_law_2 here
[Models]
  [mandel_stress]
    type = IsotropicMandelStress
    cauchy_stress = 'stress'
  []
  [vonmises]
    type = SR2Invariant
    invariant_type = 'VONMISES'
    tensor = 'mandel_stress'
    invariant = 'yield_function'
  []
  [flow]
    type = ComposedModel
    models = 'vonmises'
  []
  [normality]
    type = Normality
    model = 'flow'
    function = 'yield_function'
    from = 'mandel_stress'
    to = 'flow_direction'
  []
  [power_law_1_stress]
    type = ArrheniusParameter
    reference_value = 0.1357320095932
    activation_energy = -100000
    ideal_gas_constant = 8.314462618
    temperature = 'temperature'
  []
  [power_law_1]
    type = PerzynaPlasticFlowRate
    reference_stress = 'power_law_1_stress'
    exponent = 3
    flow_rate = 'power_law_1_rate'
  []
  [power_law_2_stress]
    type = ArrheniusParameter
    reference_value = 3.684182536103
    activation_energy = -50000
    ideal_gas_constant = 8.314462618
    temperature = 'temperature'
  []
  [power_law_2]
    type = PerzynaPlasticFlowRate
    reference_stress = 'power_law_2_stress'
    exponent = 6
    flow_rate = 'power_law_2_rate'
  []
  [sum]
    type = ScalarLinearCombination
    from = 'power_law_1_rate power_law_2_rate'
    to = 'flow_rate'
  []
  [Eprate]
    type = AssociativePlasticFlow
  []
  [Erate]
    type = SR2VariableRate
    variable = 'E'
  []
  [Eerate]
    type = SR2LinearCombination
    from = 'E_rate plastic_strain_rate'
    to = 'strain_rate'
    weights = '1 -1'
  []
  [elasticity]
    type = LinearIsotropicElasticity
    coefficients = '150000 0.3'
    coefficient_types = 'YOUNGS_MODULUS POISSONS_RATIO'
    rate_form = true
  []
  [integrate_stress]
    type = SR2BackwardEulerTimeIntegration
    variable = 'stress'
  []
  [implicit_rate]
    type = ComposedModel
    models = 'mandel_stress vonmises normality power_law_1 power_law_2 sum Eprate Erate Eerate elasticity integrate_stress'
  []
  [predictor]
    type = ConstantExtrapolationPredictor
    unknowns_SR2 = 'stress'
  []
  [model]
    type = ImplicitUpdate
    equation_system = 'equations'
    solver = 'newton'
    predictor = 'predictor'
  []
[]
[EquationSystems]
  [equations]
    type = NonlinearSystem
    model = 'implicit_rate'
    unknowns = 'stress'
    residuals = 'stress_residual'
  []
[]
[Solvers]
  [newton]
    type = Newton
    linear_solver = 'lu'
  []
  [lu]
    type = DenseLU
  []
[]
