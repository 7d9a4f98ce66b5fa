import{a}from"./chunk-BGXV6PFN.js";import"./chunk-QEQBBZGE.js";import"./chunk-FV6F74XH.js";import"./chunk-T2ACLE3U.js";import"./chunk-MATSTXXN.js";import"./chunk-OULW4S7M.js";export{a as Arena};
