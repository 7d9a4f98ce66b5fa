function e([n,r,t,a]){return Math.atan2(2*(n*a+r*t),1-2*(t*t+a*a))}export{e as a};
