"""The paper whose laws and ranges are built in."""

PAPER = (
    "H. Chen, R. Zhou, R. Zha, Z. Chen, W. Li, R. Rolark, J. P. Reidy, J. Cao, I. McCue, P. Guo, D. C. Dunand, H. D. "
    "Espinosa, Machine Learning-Driven Creep Law Discovery Across Alloy Compositional Space (manuscript)"
)
